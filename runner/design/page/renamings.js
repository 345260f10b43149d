// Names that were changed on the page, carried into the translations beside the protocol: their keys hold names.

import {NotJson, parse, replaced} from './json_text.js';
import {ask} from './server.js';

/** A key of a translation after a renaming: "blocks.first.question" of a block. */
export function renamed_key(key, [kind, from, to]) {
  const steps = key.split('.');
  if ((kind === 'blocks' || kind === 'pages') && steps[0] === kind && steps[1] === from) return [kind, to, ...steps.slice(2)].join('.');
  // Stimuli that are identified are the answers.
  if (kind === 'stimuli' && ['response', 'blocks'].includes(steps[0]) && steps.at(-2) === 'keys' && steps.at(-1) === from) return [...steps.slice(0, -1), to].join('.');
  // Of a cell of factors: "blocks.first.surface=wet,size=large.question".
  if (kind === 'factors' && steps[0] === 'blocks' && steps[2]?.includes('='))
    steps[2] = steps[2].split(',').map(level => (level.startsWith(`${from}=`) ? to + level.slice(from.length) : level)).join(',');
  return steps.join('.');
}

/** The text of a translation after renamings; only its keys change. \throws NotJson */
export function renamed_translation(text, renamings) {
  const {members = []} = parse(text);
  return [...members].reverse().reduce((now, {key, start}) => {
    const named = renamings.reduce(renamed_key, key);
    const end = now.indexOf(':', start + JSON.stringify(key).length - 1);
    return named === key ? now : replaced(now, {start, end: start + now.slice(start, end).trimEnd().length}, JSON.stringify(named));
  }, text);
}

/** Writes the renamings into every translation beside the protocol. Returns a sentence for the page, or ''. */
export async function carry(renamings) {
  if (renamings.length === 0) return '';
  const {languages} = await ask('languages'), done = [], left = [];
  for (const language of languages) {
    try {
      const {text, sha256} = await ask('translation', {language});
      const made = renamed_translation(text, renamings);
      if (made === text) continue;
      await ask('save_translation', {language, text: made, sha256});
      done.push(language);
    } catch (error) {
      left.push(`${language} (${error instanceof NotJson ? 'it is not JSON' : error.message})`);
    }
  }
  const words = done.length ? `Renamed in the translations too: ${done.join(', ')}.` : '';
  return left.length ? `${words} Not renamed in: ${left.join(', ')}.`.trim() : words;
}
