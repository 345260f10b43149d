// The study with simulated participants, and its report.

import {ask} from './server.js';
import {element} from './dom.js';

const kLook = 250;  // ms between two looks at the progress

export class RehearseView {
  constructor(document) {
    this.document = document;
    this.participants = element('input', {type: 'number', min: '1', max: '40', value: '2'});
    this.seed = element('input', {type: 'number', min: '1', max: '1000000', value: '1'});
    this.go = element('button', {type: 'button', class: 'main', text: 'Rehearse', onclick: () => this.start()});
    this.halt = element('button', {type: 'button', text: 'Stop', hidden: true, onclick: () => ask('stop').catch(error => this.say(error.message))});
    this.bar = element('progress', {value: '0', max: '1', hidden: true, 'aria-label': 'Trials done'});
    this.words = element('p', {role: 'status'});
    this.reports = element('ul');
    this.root = element('div', {class: 'card'}, element('h3', {text: 'Rehearse with simulated participants'}),
        element('p', {class: 'model', text: 'A model, not people: it shows whether the study runs and its report makes sense, not what you will find.'}),
        element('div', {class: 'bar'}, element('label', {}, 'Participants', this.participants), element('label', {}, 'Seed', this.seed), this.go, this.halt),
        this.bar, this.words, this.reports,
        element('p', {class: 'soft', text: 'Their data go into a temporary database, never into your study\u2019s, and are gone when palpate design ends. A report opens in a tab of its own.'}));
  }
  show() {}

  say(words) {
    this.words.textContent = words;
  }
  #running(is) {
    this.go.disabled = is;
    this.halt.hidden = !is;
    this.bar.hidden = !is;
  }

  async start() {
    this.say('');
    this.#running(true);
    this.bar.removeAttribute('value');
    try {
      let progress = await ask('rehearse', {text: this.document.text, participants: this.participants.valueAsNumber, seed: this.seed.valueAsNumber});
      while (progress.state === 'running') {
        if (progress.expected > 0) this.bar.value = progress.recorded / progress.expected;
        this.say(progress.expected > 0 ? `${progress.recorded} of ${progress.expected} trials` : 'The participants arrive.');
        await new Promise(resolve => setTimeout(resolve, kLook));
        progress = await ask('progress');
      }
      this.#end(progress);
    } catch (error) {
      this.say(error.message);
    }
    this.#running(false);
  }

  #end({state, why, report, recorded, expected}) {
    if (state !== 'done') return this.say(state === 'stopped' ? `Stopped after ${recorded} of ${expected} trials. ${why ?? ''}` : why);
    this.say(`${recorded} trials are done.`);
    const link = element('a', {href: `/report/${report}`, target: '_blank', rel: 'noopener', text: 'Open the report'});
    this.reports.prepend(element('li', {}, link, ` of ${this.participants.value} participants, seed ${this.seed.value}`));
    link.focus();
    return undefined;
  }
}
