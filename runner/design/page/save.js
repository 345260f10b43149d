// Saving, and what to do where the file has changed meanwhile.

import {by_id, element} from './dom.js';
import {Refused, ask} from './server.js';
import {carry} from './renamings.js';
import {split_text} from './document.js';

const kMostLines = 4000;

/** Lines of two texts: [sign, line], with '-' only in the first, '+' only in the second. */
export function line_changes(first, second) {
  const a = first.split('\n'), b = second.split('\n');
  let head = 0, tail = 0;
  while (head < Math.min(a.length, b.length) && a[head] === b[head]) ++head;
  while (tail < Math.min(a.length, b.length) - head && a.at(-1 - tail) === b.at(-1 - tail)) ++tail;
  const left = a.slice(head, a.length - tail), right = b.slice(head, b.length - tail);
  if (left.length * right.length > kMostLines * kMostLines / 4)
    return [...left.map(line => ['-', line]), ...right.map(line => ['+', line])];
  // The longest common subsequence of lines.
  const common = Array.from({length: left.length + 1}, () => new Uint32Array(right.length + 1));
  for (let i = left.length - 1; i >= 0; --i)
    for (let j = right.length - 1; j >= 0; --j)
      common[i][j] = left[i] === right[j] ? common[i + 1][j + 1] + 1 : Math.max(common[i + 1][j], common[i][j + 1]);
  const out = [];
  for (let i = 0, j = 0; i < left.length || j < right.length;) {
    if (i < left.length && j < right.length && left[i] === right[j]) {
      out.push([' ', left[i]]);
      ++i, ++j;
    } else if (j >= right.length || (i < left.length && common[i + 1][j] >= common[i][j + 1])) {
      out.push(['-', left[i++]]);
    } else {
      out.push(['+', right[j++]]);
    }
  }
  return out;
}

/** Asks a question with some answers: [[answer, label], ...]; null: Escape. */
export function choose(title, contents, answers) {
  const dialog = by_id('dialog');
  return new Promise(resolve => {
    dialog.replaceChildren(element('h3', {id: 'dialog-title', text: title}), ...contents,
        element('div', {class: 'buttons'}, ...answers.map(([answer, label], i) =>
            element('button', {type: 'button', class: i === 0 ? 'main' : null, text: label, onclick: () => dialog.close(answer)}))));
    dialog.returnValue = '';
    dialog.onclose = () => resolve(dialog.returnValue || null);
    dialog.showModal();
  });
}

function difference(theirs, mine) {
  const changes = line_changes(theirs, mine);
  return element('div', {class: 'changes', tabindex: '0', 'aria-label': 'Differences'}, ...changes.map(([sign, line]) =>
      element('div', {class: sign === '-' ? 'theirs' : sign === '+' ? 'mine' : null, text: `${sign} ${line}`})));
}

async function resolve_conflict(document, error) {
  const theirs = error.found, is_there = theirs.sha256 !== '';
  const other = split_text(theirs.text).text;
  const contents = [element('p', {text: error.message + ' Nothing was written.'})];
  if (is_there) contents.push(element('p', {class: 'soft', text: '\u2212 lines of the file, + lines of this page'}), difference(other, document.text));
  const answers = [['copy', 'Save this page\u2019s text as a new file'], ['mine', is_there ? 'Replace the file by this text' : 'Save it again under its name'],
    ...(is_there ? [['theirs', 'Take the file\u2019s text']] : []), ['', 'Not now']];
  const answer = await choose(is_there ? 'The file has changed' : 'The file is gone', contents, answers);
  if (answer === 'theirs') document.edit(other), document.was_saved(other, theirs.sha256);
  if (answer === 'mine') return save_as(document, theirs.sha256);
  return answer === 'copy' ? save_copy(document) : '';
}

async function save_as(document, sha256) {
  const {text, disk, names, renamings} = document;
  const answer = await ask('save', {text: disk, sha256});
  document.was_saved(text, answer.sha256, names);
  return carry(renamings);
}

async function save_copy(document) {
  const {name} = await ask('copy', {text: document.disk});
  return `Saved as ${name}, beside ${document.name}. This page still shows ${document.name}.`;
}

/** Saves the document, and asks where that is not plain. Returns a sentence for the page, or ''. */
export async function save(document, faults) {
  if (document.mixed) {
    const answer = await choose('Line ends of two kinds', [element('p', {text: 'Some lines of this file end with CR LF, others with LF. Saving makes all of them LF.'})],
        [['yes', 'Save'], ['', 'Not now']]);
    if (answer !== 'yes') return '';
  }
  if (faults.some(fault => fault.pointer.startsWith('line '))) {
    const answer = await choose('This text is not JSON', [element('p', {text: 'It can be saved, but nothing can read it before its faults are mended.'})],
        [['yes', 'Save it all the same'], ['', 'Not now']]);
    if (answer !== 'yes') return '';
  }
  try {
    return await save_as(document, document.sha256);
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
    if (error.found) return resolve_conflict(document, error);
    const answer = await choose('The file was not written', [element('p', {text: error.message})], [['copy', 'Save as a new file'], ['', 'Not now']]);
    return answer === 'copy' ? save_copy(document) : '';
  }
}
