// Asks the program for faults and picture after each edit, one question at a time; answers to an older text are dropped.

import {ask} from './server.js';

const kPause = 120;  // ms after the last edit

/** The protocol as far as it can be read, for names in messages. */
function values_of(text) {
  try {
    return JSON.parse(text);
  } catch {
    return undefined;
  }
}

export class CheckLoop {
  #timer = 0;
  #asking = false;

  /** \param told  {checked(check, values), pictured(picture, values), known(data, values), failed(why)} */
  constructor(document, told) {
    this.document = document;
    this.told = told;
    this.faults = [];
    this.checked_text = null;
  }

  /** Whether everything shown is of the document's text. */
  get is_settled() {
    return !this.#asking && this.document.text === this.checked_text;
  }

  begin() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#ask(), this.checked_text === null ? 0 : kPause);
  }

  async #ask() {
    if (this.#asking || this.document.text === this.checked_text) return;
    this.#asking = true;
    const {text, disk} = this.document;
    try {
      const check = await ask('check', {text: disk});
      if (text === this.document.text) {
        this.checked_text = text;
        this.faults = check.faults;
        const values = values_of(text);
        this.told.checked(check, values);
        // A picture needs a protocol that can be read; else the last one stays.
        if (check.summary) this.told.pictured(await ask('picture', {text: disk}), values);
        if (check.summary && text === this.document.text) this.told.known((await ask('data', {text: disk})).data, values);
      }
    } catch (error) {
      if (text === this.document.text) this.told.failed(error.message);
    }
    this.#asking = false;
    if (this.document.text !== text) this.begin();
  }
}
