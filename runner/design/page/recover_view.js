// How well a block's procedures find a known threshold, before the study: what palpate schedule --recover finds.

import {ask} from './server.js';
import {element} from './dom.js';
import {pointer_of_path} from './json_text.js';

const kColumns = [['procedure', 'procedure'], ['true_threshold', 'true threshold'], ['bias', 'bias'], ['bias_se', '\u00b1'], ['spread', 'spread'], ['mean_trials', 'trials'],
  ['without_estimate', 'without estimate']];
const shown = value => String(+value.toPrecision(4));

function table_of({procedures, participants}, unit) {
  const columns = kColumns.filter(([key]) => key !== 'procedure' || procedures.length > 1);
  const head = (key, words) => element('th', {scope: 'col', text: key === 'true_threshold' && unit ? `${words} (${unit})` : words});
  return [element('table', {}, element('thead', {}, element('tr', {}, ...columns.map(([key, words]) => head(key, words)))),
      element('tbody', {}, ...procedures.map(row => element('tr', {}, ...columns.map(([key]) => element('td', {class: 'number', text: shown(row[key])})))))),
  element('p', {class: 'soft', text: `${participants} simulated participants whose threshold is known. Bias and spread are on the procedure\u2019s scale; \u00b1 is the standard error of the bias.`})];
}

/** What a form keeps of the answers: they stay while the block does. */
export class Recoveries {
  #kept = new Map();

  /** The button of a block's procedure, with its last answer. */
  place(context, path) {
    const block = path.slice(0, 2), name = context.value([...block, 'name']), raw = context.raw(block);
    const words = element('span', {class: 'soft', role: 'status'}), out = element('div', {class: 'scroll'});
    const people = element('input', {type: 'number', min: '2', max: '10000', value: '200', class: 'number', 'aria-label': 'Simulated participants', 'data-pointer': `${pointer_of_path(path)}#people`});
    const kept = this.#kept.get(name);
    const put = answer => out.replaceChildren(...table_of(answer, context.form.unit_of_level(path)));
    const go = element('button', {type: 'button', text: 'Bias and spread', 'data-pointer': `${pointer_of_path(path)}#recover`, onclick: async () => {
      go.disabled = true;
      words.textContent = 'Participants are simulated.';
      try {
        const answer = await ask('recover', {text: context.document.disk, block: name, participants: people.valueAsNumber});
        this.#kept.set(name, {raw: context.raw(block), answer});
        put(answer);
        words.textContent = '';
      } catch (error) {
        words.textContent = error.message.split('\n')[0];
      }
      go.disabled = false;
    }});
    if (kept?.raw === raw) put(kept.answer);
    return element('div', {class: 'recover'}, element('div', {class: 'bar'}, go, element('label', {}, 'of', people, 'participants'), words), out);
  }
}
