// What the program finds in the text: faults with their places, time and trials, devices with their reasons.

import {by_id, counted, element, spoken_time} from './dom.js';

const kMostShown = 200;

/** "/stimuli/1/radius_m" in words: "cone, radius_m". */
export function place_in_words(pointer, values) {
  if (!pointer.startsWith('/') || pointer === '/') return pointer === '/' || pointer === '' ? 'the file' : pointer;
  let value = values;
  const words = [];
  for (const token of pointer.split('/').slice(1)) {
    const key = token.replace(/~1/g, '/').replace(/~0/g, '~');
    const in_list = Array.isArray(value);
    value = value?.[key];
    if (in_list && typeof value?.name === 'string' && value.name !== '') words[words.length - 1] = value.name;
    else words.push(in_list && /^\d+$/.test(key) ? String(Number(key) + 1) : key);
  }
  return words.join(', ');
}

function show_faults(check, values, go_to) {
  const {faults} = check;
  const verdict = by_id('verdict');
  verdict.textContent = faults.length === 0 ? 'No faults: this protocol can be run.' : counted(faults.length, 'fault');
  verdict.className = faults.length === 0 ? 'good' : 'bad';
  by_id('faults').replaceChildren(...faults.slice(0, kMostShown).map(fault => element('li', {},
      element('button', {type: 'button', class: 'plain place', onclick: () => go_to(fault),
        text: place_in_words(fault.pointer, values) + (fault.line ? ` (line ${fault.line})` : '')}),
      element('span', {text: fault.text}))));
  const more = faults.length - kMostShown;
  if (more > 0) by_id('faults').append(element('li', {text: `and ${more} more`}));
  const notes = [...(check.notes ?? [])];
  if (check.built_in_texts?.length) notes.push(`Built-in English texts are shown for: ${check.built_in_texts.join(', ')}.`);
  by_id('notes').replaceChildren(...notes.map(note => element('li', {text: note})));
}

function rows_about(check) {
  const {summary} = check;
  const rows = [['Trials', `${summary.trials} for each participant, practice besides`],
    ['Time', `about ${spoken_time(check.duration_s)}, at most ${spoken_time(check.longest_s)}; breaks and pages besides`],
    ['Sessions', String(summary.sessions)], ['Rendered as', summary.renderers.join(', ')]];
  for (const [factor, levels] of Object.entries(summary.factors ?? {})) rows.push([`Factor ${factor}`, levels.join(', ')]);
  if (summary.groups) rows.push(['Groups', `${summary.groups.names.join(', ')} (${summary.groups.assign})`]);
  for (const [name, words] of check.in_words ?? []) rows.push([name, words.join('; ')]);
  return rows;
}

function device_item(device) {
  const name = device.name === 'simulate' ? 'simulated participants' : device.name;
  const label = device.group ? `${name}, group ${device.group}` : name;
  const limits = device.limits ?? [];
  if (device.can && limits.length === 0)
    return element('li', {}, element('span', {class: 'yes', text: 'yes '}), label);
  const why = device.can ? limits : device.reasons.map(reason =>
      reason.where.length > 1 ? `${reason.text} (${counted(reason.where.length, 'place')})` : reason.text);
  return element('li', {}, element('details', {},
      element('summary', {}, element('span', {class: device.can ? 'yes' : 'no', text: device.can ? 'yes ' : 'no '}),
          `${label}: ${counted(why.length, device.can ? 'limit' : 'reason')}`),
      element('ul', {}, ...why.map(text => element('li', {text})))));
}

/** Shows an answer of "check". What only a protocol without faults has stays as it was, and is dimmed. */
export function show_check(check, values, go_to) {
  show_faults(check, values, go_to);
  const about = by_id('about'), devices = by_id('devices');
  const whole = check.faults.length === 0 && check.summary !== undefined;
  for (const part of [about, devices, by_id('picture')]) part.classList.toggle('stale', !whole);
  if (!whole) return;
  about.querySelector('dl').replaceChildren(
      ...rows_about(check).flatMap(([term, text]) => [element('dt', {text: term}), element('dd', {text})]));
  const able = device => (device.can ? 0 : 1);
  devices.querySelector('ul').replaceChildren(
      ...[...check.devices].sort((a, b) => able(a) - able(b)).map(device_item));
}

/** "study.db holds 3 participants of this protocol as it was." */
function data_in_words({database, participants, simulated, same, differs, only_texts}, name) {
  const people = `${participants} ${simulated ? 'simulated ' : ''}${participants === 1 ? 'participant' : 'participants'}`;
  if (same) return `${database} holds ${people} of this protocol as it is now: a change of it makes another study.`;
  const then = only_texts ? 'Only texts differ: palpate run shows the new ones to those who have begun with --changed-protocol texts.' :
    'This is another study now: give it another name. Those who have begun go on with the protocol that is stored with their data.';
  return `${database} holds ${people} of the protocol ${name} as it was before (now other: ${differs}). ${then}`;
}

/** Shows what data the protocol's name has already. */
export function show_data(data, values) {
  by_id('data').replaceChildren(...data.map(one => element('li', {class: one.same ? 'soft' : 'warning', text: data_in_words(one, values?.name)})));
}

/** Shows that a text was not checked. */
export function show_failure(why) {
  by_id('verdict').textContent = `Not checked: ${why}`;
  by_id('verdict').className = 'bad';
  for (const part of ['about', 'devices', 'picture']) by_id(part).classList.add('stale');
}
