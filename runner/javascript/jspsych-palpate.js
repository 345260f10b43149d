// A jsPsych plugin (version 7 or 8): one trial felt through `palpate serve`, answered with a button or a key.
//
//   import {connect} from './palpate.js';
//   import {palpate_plugin} from './jspsych-palpate.js';
//   const hand = await connect(url, token);
//   const trial = {type: palpate_plugin(hand), choices: ['ball', 'box'], stimulus: 'ball', renderer: 'ray'};
//
// `data` gets what palpate has on record: trial, stimulus, renderer, response, correct, response_time_s,
// first_contact_s, missed_ticks and more; `rt` in ms, as other plugins have it. Times: `t_ns` of the answer by palpate's
// clock (CLOCK_MONOTONIC, as in its record), `at_ms` of the click or key by the page's (performance.now()); the one is the
// other plus `clock_offset_ms`, within `clock_within_ms`. `stamped` says which of them counts: 'client' is the page's,
// 'arrival' that the page's clock was not known within 1 ms and the answer counts from when it came.

const TEXT = 'STRING', YES = 'BOOL', NUMBER = 'FLOAT';  // jsPsych's ParameterType, without its module

export const info = {
  name: 'palpate',
  version: '1.0.0',
  parameters: {
    choices: {type: TEXT, array: true, default: undefined},  // what may be answered, as palpate knows it
    labels: {type: TEXT, array: true, default: []},          // what is read instead
    keys: {type: TEXT, array: true, default: []},            // one for each choice; none: buttons alone
    prompt: {type: 'HTML_STRING', default: ''},
    waiting: {type: 'HTML_STRING', default: 'Take the stylus away from the middle and hold it still.'},
    stimulus: {type: TEXT, default: null},                   // in a block that palpate does not plan
    renderer: {type: TEXT, default: null},
    level: {type: NUMBER, default: null},
    orientation_wxyz: {type: NUMBER, array: true, default: []},
    intervals: {type: 'COMPLEX', array: true, default: []},  // of one trial: {stimulus, renderer, level, standard}
    go_on: {type: TEXT, default: 'Next'},                    // the button between intervals; of timed ones none is shown
    timed_intervals: {type: YES, default: false},            // the protocol has interval_limit_s
    try_again: {type: YES, default: true},                   // where forces went off before the answer
  },
  data: {
    trial: {type: 'INT'}, stimulus: {type: TEXT}, renderer: {type: TEXT}, response: {type: TEXT}, correct: {type: YES},
    response_time_s: {type: NUMBER}, first_contact_s: {type: NUMBER}, missed_ticks: {type: 'INT'}, rt: {type: NUMBER},
    t_ns: {type: 'INT'}, at_ms: {type: NUMBER}, clock_offset_ms: {type: NUMBER}, clock_within_ms: {type: NUMBER},
    stamped: {type: TEXT}, timed_out: {type: YES},
  },
  citations: {apa: '', bibtex: ''},
};

const element = (kind, parent, text = '') => {
  const out = document.createElement(kind);
  out.textContent = text;
  parent.append(out);
  return out;
};

/** The plugin for a connection of palpate.js. */
export function palpate_plugin(hand) {
  return class PalpatePlugin {
    static info = info;

    constructor(jsPsych) {
      this.jsPsych = jsPsych;
    }

    async trial(display, trial, on_load, simulated_rt = null) {
      const what = {};
      for (const name of ['stimulus', 'renderer', 'level', 'orientation_wxyz', 'intervals'])
        if ((trial[name] ?? null) !== null && trial[name].length !== 0) what[name] = trial[name];
      if (hand.next) what.trial = hand.next.trial;
      on_load?.();
      for (;;) {
        try {
          display.innerHTML = trial.waiting;
          await hand.clock(5);
          const asked = trial.timed_intervals ? hand.wait_for('question') : null;
          asked?.catch(() => {});
          await hand.start(what);
          const intervals = hand.next?.intervals ?? 1;
          for (let i = 1; i < intervals && !asked; ++i) {
            await this.#choice(display, {...trial, choices: [trial.go_on], labels: [], keys: []},
                               simulated_rt && {...simulated_rt, response: trial.go_on});
            display.innerHTML = trial.waiting;
            await hand.next_interval();
          }
          if (asked) await Promise.race([asked, this.#stopped()]);
          const {choice, at_ms, stored} = await this.#choice(display, trial, simulated_rt);
          if (stored) return this.#finish(display, stored, {});
          const said = await hand.answer(choice, {at_ms});
          return this.#finish(display, said, {rt: 1000 * said.response_time_s, at_ms});
        } catch (error) {
          if (error.code === 'timed-out') return this.#finish(display, error.stored, {});
          if (error.code === 'closed') display.textContent = `palpate: ${error.reason}. Forces are off.`;
          if (!trial.try_again || !['emergency', 'forces-off', 'stopped', 'nothing-felt'].includes(error.code)) throw error;
          await this.#go_on(display, error);
        }
      }
    }

    /** 'data-only' gives data without the server; 'visual' feels the trial and presses a button after a time. */
    simulate(trial, mode, options, on_load) {
      const rt = options.data?.rt ?? 500 + 1500 * Math.random();
      const response = options.data?.response ?? trial.choices[Math.floor(trial.choices.length * Math.random())];
      if (mode === 'visual')
        return this.trial(this.jsPsych.getDisplayElement(), trial, on_load, {rt, response});
      on_load?.();
      this.jsPsych.finishTrial({
        trial: null, stimulus: trial.stimulus, renderer: trial.renderer, response, correct: response === trial.stimulus,
        timed_out: false, response_time_s: rt / 1000, rt, ...options.data});
    }

    #finish(display, said, {rt = null, at_ms = null}) {
      const {offset_ms, within_ms} = hand.best_clock;
      const data = {...said, rt, at_ms, clock_offset_ms: offset_ms, clock_within_ms: within_ms};
      if (said.timed_out) data.response = null;
      for (const name of ['re', 'ok', 'next', 'record', 'event']) delete data[name];
      display.innerHTML = '';
      return this.jsPsych.finishTrial(data);
    }

    /** Resolves with {choice, at_ms}: one of the choices, and when; or with {stored}, where the protocol's time was over. */
    #choice(display, trial, simulated) {
      display.innerHTML = trial.prompt;
      let timer = null;
      return new Promise((resolve, reject) => {
        const off = event => done(() => reject(Object.assign(
            new Error(event.detail.reason), {code: event.detail.code === 'emergency' ? 'emergency' : 'forces-off'})));
        const stored = event => done(() => resolve({stored: event.detail}));
        const gone = () => done(() => reject(Object.assign(new Error('closed'), {code: 'closed', reason: 'the server has gone'})));
        const pressed = event => {
          const at = (trial.keys ?? []).indexOf(event.key);
          if (at >= 0) done(() => resolve({choice: trial.choices[at], at_ms: event.timeStamp}));
        };
        const done = act => {
          document.removeEventListener('keydown', pressed);
          clearTimeout(timer);
          hand.removeEventListener('forces_off', off);
          hand.removeEventListener('stored', stored);
          hand.removeEventListener('closed', gone);
          act();
        };
        const row = element('div', display);
        trial.choices.forEach((choice, i) => {
          const button = element('button', row, trial.labels?.[i] ?? choice);
          button.className = 'jspsych-btn';
          button.dataset.choice = choice;
          button.addEventListener('click', event => done(() => resolve({choice, at_ms: event.timeStamp})));
        });
        document.addEventListener('keydown', pressed);
        hand.addEventListener('forces_off', off);
        hand.addEventListener('stored', stored);
        if (simulated) timer = setTimeout(() => {
          display.querySelector(`[data-choice="${CSS.escape(simulated.response)}"]`)?.click();
        }, simulated.rt);
        hand.addEventListener('closed', gone);
      });
    }

    /** Rejects when forces go off. */
    #stopped() {
      return hand.wait_for('forces_off').then(said => {
        throw Object.assign(new Error(said.reason), {code: said.code === 'emergency' ? 'emergency' : 'forces-off'});
      });
    }

    /** Forces went off: a person says when they may come again; of another client's emergency, where it was raised. */
    #go_on(display, error) {
      display.innerHTML = '';
      element('p', display, `Forces are off: ${error.reason ?? error.message}`);
      if (error.code === 'emergency' && !hand.emergency_raised) return hand.wait_for('cleared');
      const button = element('button', display, 'Go on');
      button.className = 'jspsych-btn';
      button.dataset.choice = 'go on';
      return new Promise(resolve => button.addEventListener('click', () => resolve(hand.clear().catch(() => {}))));
    }
  };
}
