// The text of the protocol, which is the only truth: every view shows it and replaces parts of it. Undo is the history
// of the text, so that it goes back to the first byte.

const kMostSteps = 2000;
const kTypingPause = 1000;  // ms; edits of one kind within it are one step

/** A text of a file apart: what a text area cannot hold is kept beside the text. */
export function split_text(disk) {
  const bom = disk.startsWith('\uFEFF') ? '\uFEFF' : '';
  const body = disk.slice(bom.length);
  const crlf = /\r\n/.test(body) && !/(^|[^\r])\n|\r(?!\n)/.test(body);
  const mixed = !crlf && body.includes('\r');
  return {bom, crlf, mixed, text: crlf || mixed ? body.replace(/\r\n?/g, '\n') : body};
}

export class Document {
  #listeners = [];
  #saved_listeners = [];
  #past = [];
  #future = [];
  #last = {kind: '', time: 0};
  #names = [];  // renamings from the opened text to this one: [[kind, from, to], ...]
  #saved_names = [];

  constructor(opened) {
    this.name = opened.name;
    this.take_disk(opened.text, opened.sha256, opened.exists);
  }

  /** The content of the file is now this one; forgets the history. */
  take_disk(text, sha256, exists) {
    const {bom, crlf, mixed, text: body} = split_text(text);
    Object.assign(this, {bom, crlf, mixed, sha256, exists, text: body, saved: exists ? body : null});
    this.#past = [];
    this.#future = [];
    this.#names = this.#saved_names = [];
    this.#tell();
  }

  /** The renamings that lead from the saved text to this one, an undone one backwards. */
  get renamings() {
    return this.#renamings_to(this.#names);
  }
  #renamings_to(now) {
    const saved = this.#saved_names;
    let same = 0;
    while (same < Math.min(now.length, saved.length) && now[same] === saved[same]) ++same;
    const back = saved.slice(same).reverse().map(([kind, from, to]) => [kind, to, from]);
    return [...back, ...now.slice(same)];
  }

  /** Calls back with this document after every change of its text or state. */
  listen(listener) {
    this.#listeners.push(listener);
  }
  /** Calls back with the renamings of a saved text, at once. */
  listen_saved(listener) {
    this.#saved_listeners.push(listener);
  }
  #tell() {
    this.#listeners.forEach(listener => listener(this));
  }

  /** As it is written to the disk. */
  get disk() {
    return this.bom + (this.crlf ? this.text.replace(/\n/g, '\r\n') : this.text);
  }
  get is_saved() {
    return this.saved === this.text;
  }

  /** Replaces the text. `kind`: edits of one kind in quick succession are one step of undo, '' never is. `renaming`: it is one. */
  edit(text, kind = '', renaming = null) {
    if (text === this.text) return;
    const now = Date.now();
    const joins = kind !== '' && kind === this.#last.kind && now - this.#last.time < kTypingPause && this.#past.length > 0;
    this.#last = {kind, time: now};
    if (!joins) this.#past.push({text: this.text, names: this.#names});
    if (this.#past.length > kMostSteps) this.#past.shift();
    this.#future = [];
    this.text = text;
    if (renaming) this.#names = [...this.#names, renaming];
    this.#tell();
  }

  get can_undo() {
    return this.#past.length > 0;
  }
  get can_redo() {
    return this.#future.length > 0;
  }
  undo() {
    this.#step(this.#past, this.#future);
  }
  redo() {
    this.#step(this.#future, this.#past);
  }
  #step(from, to) {
    if (from.length === 0) return;
    to.push({text: this.text, names: this.#names});
    const {text, names} = from.pop();
    this.text = text;
    this.#names = names;
    this.#last = {kind: '', time: 0};
    this.#tell();
  }

  /** What stands now in the renamings, for was_saved(). */
  get names() {
    return this.#names;
  }
  /** It is on the disk with this checksum. `text`: what was written, with its `names`; it may have changed since. */
  was_saved(text, sha256, names = this.#names) {
    const renamings = this.#renamings_to(names);
    this.saved = text;
    this.#saved_names = names;
    if (renamings.length) this.#saved_listeners.forEach(listener => listener(renamings));
    this.sha256 = sha256;
    this.exists = true;
    this.mixed = false;
    this.#tell();
  }
}
