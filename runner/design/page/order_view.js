// The trials of a participant, in order, as far as they are known before the answers.

import {ask} from './server.js';
import {element} from './dom.js';

const kWords = {block_name: 'block', shape: 'stimulus', catch_trial: 'catch', comparison_interval: 'comparison'};
const kHidden = new Set(['block', 'example', 'task']);

const in_words = value => (value === null ? '' : value === true ? 'yes' : value === false ? '' : typeof value === 'number' ? String(+value.toPrecision(6)) : String(value));

export class OrderView {
  constructor(document) {
    this.document = document;
    this.participant = element('input', {type: 'number', min: '1', max: '1000000', value: '1', oninput: () => this.ask()});
    this.words = element('span', {class: 'soft', role: 'status'});
    this.table = element('table');
    this.root = element('div', {class: 'card'}, element('h3', {text: 'The order of a participant'}),
        element('div', {class: 'bar'}, element('label', {}, 'Participant number', this.participant), this.words),
        element('div', {class: 'scroll', tabindex: '0', 'aria-label': 'Trials in order'}, this.table));
  }
  show() {
    this.ask();
  }

  async ask() {
    const {text} = this.document, participant = this.participant.valueAsNumber;
    if (!(participant >= 1)) return this.say('a number from 1');
    try {
      const answer = await ask('schedule', {text, participant});
      if (text === this.document.text && participant === this.participant.valueAsNumber) this.#put(answer);
    } catch (error) {
      if (text === this.document.text) this.say(error.found === undefined && error.name !== 'Error' ? 'no order while there are faults' : error.message.split('\n')[0]);
    }
    return undefined;
  }
  say(words) {
    this.words.textContent = words;
    this.root.querySelector('.scroll').classList.add('stale');
  }

  #put({columns, rows, all, group}) {
    const own_names = columns.includes('block_name');
    const shown = columns.map((name, i) => [name, i]).filter(([name]) => !kHidden.has(name) || (name === 'block' && !own_names));
    const practice = columns.indexOf('practice'), example = columns.indexOf('example');
    this.table.replaceChildren(
        element('thead', {}, element('tr', {}, ...shown.map(([name]) => element('th', {scope: 'col', text: kWords[name] ?? name.replaceAll('_', ' ')})))),
        element('tbody', {}, ...rows.map(row => element('tr', {class: row[practice] ? 'practice' : null},
            ...shown.map(([, i]) => element('td', {class: typeof row[i] === 'number' ? 'number' : null, text: in_words(row[i])}))))));
    const examples = rows.some(row => row[example] === true);
    this.words.textContent = `${all} trials` + (group ? `, group ${group}` : '') + (rows.length < all ? `, the first ${rows.length} here` : '') +
        (examples ? '; levels that answers choose are an example' : '');
    this.root.querySelector('.scroll').classList.remove('stale');
  }
}
