// Drives `palpate serve` from a page: an ES module without dependencies.
//
//   import {connect} from './palpate.js';
//   const hand = await connect('ws://127.0.0.1:49213', token);
//   await hand.start({stimulus: 'cube', renderer: 'ray', trial: 1});  // resolves once forces are on
//   const trial = await hand.answer('cube');                         // on record, where there is a protocol
//
// The messages: protocols/serve.schema.json. Forces stay palpate's. A page that is hidden or closed says nothing any
// more: forces go off.

const ALIVE_EVERY = 200;  // ms; the server waits for half a second
const CLOCK_FOR = 5000;   // ms; the server takes two clocks for drifting apart
const CLOCK_DRIFT = 50e-6;  // of two quartz clocks
const WIDTHS = {tip: 3, tail: 3, force: 3, rendered: 3, contact: 3};  // columns; else one

/** The server refused a message, or has gone. `code` is for programs, `place` a JSON pointer. */
export class ServeError extends Error {
  constructor({code, message, place = '', faults = []}, stored = null) {
    super(`${code}: ${message}${place ? ` (${place})` : ''}`);
    this.name = 'ServeError';
    Object.assign(this, {code, reason: message, place, faults, stored});  // stored: of 'timed-out', the trial on record
  }
}

const has_gone = () => new ServeError({code: 'closed', message: 'the server has gone'});

/** One connection; made by connect(). A 'closed' event says that the server has gone. */
export class Hand extends EventTarget {
  #socket;
  #number = 0;
  #waiting = new Map();
  #fields = [];
  #alive = null;
  #clock_asked = -Infinity;  // ms, of performance.now()
  #clock_seen = 0;   // ns: when the server sent the newest answer of clock()

  /** What the server said of itself; with a protocol `server.record` has participant, session and what is stored. */
  server = {};
  /** With a protocol: the trial that is due; null behind the last one. */
  next = null;
  /** Rows that the server left out because this page did not keep up. */
  dropped = 0;
  /** Whether this page has asked for zero force and not taken it back by clear(). */
  emergency_raised = false;
  /** As clock() found it: {offset_ms, within_ms, round_trip_ms, asked_ms}; null before. */
  best_clock = null;

  constructor(socket) {
    super();
    this.#socket = socket;
    socket.addEventListener('message', event => this.#take(JSON.parse(event.data)));
    socket.addEventListener('close', () => this.#end());
  }

  #end() {
    clearInterval(this.#alive);
    for (const {reject} of this.#waiting.values()) reject(has_gone());
    this.#waiting.clear();
    this.dispatchEvent(new Event('closed'));
  }

  #take(message) {
    if (message.re !== undefined && message.re !== null) {
      const waiting = this.#waiting.get(message.re);
      this.#waiting.delete(message.re);
      if (!waiting) return;
      if (message.ok) waiting.resolve(message);
      else waiting.reject(new ServeError(message.error, message.stored));
    } else if (message.stream) {
      this.dropped += message.dropped;
      this.dispatchEvent(new CustomEvent('samples', {detail: this.#rows(message.stream)}));
    } else if (message.event) {
      if (message.event === 'cleared') this.emergency_raised = false;
      if (message.event === 'stored') this.#next(message);  // also of a trial that timed out
      this.dispatchEvent(new CustomEvent(message.event, {detail: message}));
      this.dispatchEvent(new CustomEvent('event', {detail: message}));
    }
  }

  #rows(rows) {
    return rows.map(([t_ns, tick, ...values]) => {
      const row = {t_ns, tick};
      let at = 0;
      for (const field of this.#fields) {
        const width = WIDTHS[field] ?? 1;
        row[field] = width > 1 ? values.slice(at, at + width) : values[at];
        at += width;
      }
      return row;
    });
  }

  #next(said) {
    if (said.record) this.next = said.record.next;
    else if (said.next !== undefined) this.next = said.next;
    return said;
  }

  /** Any message; resolves with its answer, rejects with ServeError where it is refused. */
  ask(type, values = {}) {
    if (this.#socket.readyState !== WebSocket.OPEN)
      return Promise.reject(has_gone());
    const id = ++this.#number;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, {resolve, reject});
      this.#socket.send(JSON.stringify({id, type, ...values}));
    });
  }

  /** For connect(). */
  async hello(token, role) {
    this.server = this.#next(await this.ask('hello', {token, version: 1, role}));
    if (role !== 'control') return;
    this.#alive = setInterval(() => {
      if (this.#socket.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify({id: 0, type: 'alive'}));
    }, ALIVE_EVERY);
  }

  /** A scene, as in scene.schema.json; every fault is in ServeError.faults. */
  load(scene) { return this.ask('load', {scene}); }
  /** Forces on: {stimulus, renderer, trial, level, orientation_wxyz}, each may be left out, or `intervals`, a list of
      {stimulus, renderer, level, standard}. Resolves once they are. */
  start(what = {}) { return this.ask('start', what); }
  /** On to the next interval of the trial; resolves once its forces are on. The answer is due in the last. Intervals that
      the protocol limits follow by themselves: events 'interval', and 'question' for the answer. */
  next_interval() { return this.ask('next'); }
  /** Ends the trial; resolves with what it was like. `more`: {correct, at_ms, t_ns}. `at_ms`: when it was given, by the
      page's clock, as event.timeStamp; `t_ns`: by the server's. The server takes the time if it knows the page's clock
      within 1 ms: `stamped` says 'client', else 'arrival'. */
  async answer(response, {at_ms, ...more} = {}) {
    const timed = at_ms !== undefined || (more.t_ns !== undefined && this.best_clock);
    if (timed && performance.now() - this.#clock_asked > CLOCK_FOR) await this.clock(this.best_clock ? 3 : 10);
    if (at_ms === undefined) return this.#next(await this.ask('answer', {response, ...more}));
    const t_ns = this.server_ns(at_ms);
    try {
      return this.#next(await this.ask('answer', {response, ...more, t_ns}));
    } catch (error) {
      // An answer of just now lies in the server's future if the offset is too large by more than its way there.
      const is_new = this.server_ns() - t_ns < 1e6 * (this.best_clock.round_trip_ms + 1);
      if (error.place !== '/t_ns' || !is_new) throw error;
      return this.#next(await this.ask('answer', {response, ...more}));
    }
  }
  /** Changes the scene at a JSON pointer. */
  set(path, value) { return this.ask('set', {path, value}); }
  /** Forces off, without an answer. */
  stop(reason = '') { return this.ask('stop', {reason}); }
  /** An event for all clients; in words. */
  mark(code, text = '') { return this.ask('mark', {code, text}); }
  note(text) { return this.ask('note', {text}); }
  /** Zero force at once, until clear() of this page or of a person at the server. */
  emergency() {
    this.emergency_raised = true;
    return this.ask('emergency');
  }
  /** Forces may come again: for a person to say. Another client's emergency is refused with the code 'emergency'; the
      event 'cleared' tells when it is over. */
  clear() { return this.ask('clear'); }
  /** Rows of ticks from now on, as 'samples' events; 0 ends them. */
  async subscribe(rate_hz = 60, fields = ['tip', 'force']) {
    const said = await this.ask('subscribe', {rate_hz, fields});
    this.#fields = fields;
    return said;
  }
  /** The server's clock less performance.now(), by the quickest of so many questions: {offset_ms, within_ms, ...}; it is
      kept as best_clock. */
  async clock(times = 10) {
    const known = this.best_clock;
    // A quicker answer of before counts for less with time.
    const now = performance.now();
    let best = known && {...known, round_trip_ms: known.round_trip_ms + 2 * CLOCK_DRIFT * (now - known.asked_ms), asked_ms: now};
    for (let i = 0; i < times; ++i) {
      const sent = performance.now();
      this.#clock_asked = sent;
      const said = await this.ask('clock', {t_client: sent * 1e6, ...(this.#clock_seen && {t_seen_ns: this.#clock_seen})});
      this.#clock_seen = said.t_sent_ns;
      const came = performance.now();
      const round_trip_ms = came - sent - (said.t_sent_ns - said.t_received_ns) / 1e6;
      const offset_ms = (said.t_received_ns + said.t_sent_ns) / 2e6 - (sent + came) / 2;
      if (!best || round_trip_ms < best.round_trip_ms)
        best = {offset_ms, within_ms: round_trip_ms / 2, round_trip_ms, asked_ms: sent};
    }
    this.best_clock = {...best, within_ms: best.round_trip_ms / 2};
    return this.best_clock;
  }
  /** The server's time, ns, at a time of the page's clock (performance.now(), event.timeStamp), as far as clock() knows. */
  server_ns(at_ms = performance.now()) {
    if (!this.best_clock) throw new Error('the server\'s clock is not known: ask clock() first');
    return Math.round(1e6 * (at_ms + this.best_clock.offset_ms));
  }
  /** The page's time, ms, at a time of the server's: `t_ns` of events and rows. */
  page_ms(t_ns) {
    if (!this.best_clock) throw new Error('the server\'s clock is not known: ask clock() first');
    return t_ns / 1e6 - this.best_clock.offset_ms;
  }
  /** The next event of that name, as {event, t_ns, ...}; rejects with ServeError if the server goes before. */
  wait_for(name) {
    if (this.#socket.readyState !== WebSocket.OPEN) return Promise.reject(has_gone());
    return new Promise((resolve, reject) => {
      const heard = new AbortController();
      const once = (what, act) => this.addEventListener(what, event => (heard.abort(), act(event)), {signal: heard.signal});
      once(name, event => resolve(event.detail));
      once('closed', () => reject(has_gone()));
    });
  }
  /** Says goodbye: what is felt stops. */
  async close() {
    await this.ask('bye').catch(() => {});
    this.#socket.close();
  }
}

/** @returns a Hand. `role`: 'control', or 'watch' for a second monitor. */
export function connect(url, token, {role = 'control'} = {}) {
  return new Promise((resolve, reject) => {
    const socket = new WebSocket(url, 'palpate.1');
    const hand = new Hand(socket);
    socket.addEventListener('open', () => hand.hello(token, role).then(() => resolve(hand), reject));
    socket.addEventListener('error', () => reject(new ServeError({
      code: 'closed', message: `no server at ${url}, or it does not allow pages from ${location.origin} ` +
          '(--allow-origin), or the browser does not (allow the page to reach this computer\'s network)'})));
  });
}
