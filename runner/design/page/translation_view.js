// What the participant reads, beside its translation into another language.

import {Refused, ask} from './server.js';
import {choose} from './save.js';
import {element} from './dom.js';
import {renamed_key} from './renamings.js';

const kPause = 300;  // ms after the last edit

export class TranslationView {
  constructor(document) {
    this.document = document;
    this.language = '';
    this.texts = [];
    this.translated = new Map();
    this.stray = [];
    this.known = element('datalist', {id: 'languages'});
    this.code = element('input', {type: 'text', list: 'languages', size: '8', placeholder: 'de', spellcheck: 'false', onchange: () => this.open(this.code.value.trim())});
    this.words = element('span', {class: 'soft', role: 'status'});
    this.keep = element('button', {type: 'button', class: 'main', text: 'Save translation', disabled: true, onclick: () => this.save()});
    this.table = element('div', {class: 'pairs'});
    this.root = element('div', {class: 'card'}, element('h3', {text: 'Translations'}),
        element('p', {class: 'soft', text: 'Answers are stored in the protocol\u2019s own words, whatever the participant reads.'}),
        element('div', {class: 'bar'}, element('label', {}, 'Language', this.code), this.known, this.keep, this.words), this.table);
    document.listen_saved(renamings => {  // what was typed here keeps its place
      this.translated = new Map([...this.translated].map(([key, value]) => [renamings.reduce(renamed_key, key), value]));
    });
    addEventListener('beforeunload', event => {
      if (this.is_changed) event.preventDefault();
    });
  }

  async show() {
    try {
      const {texts, languages} = await ask('texts', {text: this.document.disk});
      this.texts = texts;
      this.known.replaceChildren(...languages.map(value => element('option', {value})));
      if (!this.language && languages.length > 0) await this.open(this.code.value = languages[0]);
      else this.#build();
    } catch {
      this.table.replaceChildren();
      this.words.textContent = 'Mend the protocol\u2019s faults first.';
    }
  }

  /** Reads the translation of a language, or begins one. */
  async open(language) {
    if (language === '' || language === this.language) return;
    if (this.is_changed) {
      const answer = await choose(`Leave the translation ${this.language}?`, [element('p', {text: 'What has changed is not saved.'})], [['yes', 'Leave it'], ['', 'Stay']]);
      if (answer !== 'yes') {
        this.code.value = this.language;
        return;
      }
    }
    try {
      const {text, sha256} = await ask('translation', {language});
      this.translated = new Map(text === '' ? [] : Object.entries(JSON.parse(text)));
      Object.assign(this, {language, sha256, is_changed: false});
      this.#build();
    } catch (error) {
      this.words.textContent = error instanceof SyntaxError ? `The file of ${language} is not JSON: mend it in an editor.` : error.message;
    }
  }

  #build() {
    if (this.language === '') return this.table.replaceChildren();
    const keys = new Set(this.texts.map(([key]) => key));
    this.stray = [...this.translated.keys()].filter(key => !keys.has(key));
    this.table.replaceChildren(...this.texts.map(([key, original]) => {
      const area = element('textarea', {rows: String(Math.max(1, Math.ceil(original.length / 28))), 'aria-label': `${key}, ${this.language}`, lang: this.language, 'data-key': key, oninput: () => {
        if (area.value === '') this.translated.delete(key);
        else this.translated.set(key, area.value);
        this.is_changed = true;
        this.#count();
      }});
      area.value = this.translated.get(key) ?? '';
      return element('div', {class: 'pair'}, element('span', {class: 'key', text: key}), element('p', {text: original}), area, element('span', {class: 'fault', hidden: true}));
    }));
    return this.#count();
  }

  /** The file has other keys now. */
  async renamed(renamings) {
    if (this.language === '' || renamings.length === 0) return;
    this.sha256 = (await ask('translation', {language: this.language})).sha256;
    await this.show();
  }

  get as_text() {
    const lines = this.texts.filter(([key]) => this.translated.has(key)).map(([key]) => ` ${JSON.stringify(key)}: ${JSON.stringify(this.translated.get(key))}`);
    return `{\n${lines.join(',\n')}\n}\n`;
  }

  #count() {
    const missing = this.texts.filter(([key]) => !this.translated.has(key)).length;
    const stray = this.stray.length ? `; ${this.stray.length} that the protocol no longer has go when it is saved` : '';
    this.words.textContent = `${this.texts.length - missing} of ${this.texts.length} translated${stray}`;
    this.keep.disabled = !this.is_changed && this.stray.length === 0;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#check(missing), kPause);
  }

  /** Marks what the program does not accept; missing ones are counted, not marked. */
  async #check(missing) {
    const translation = this.as_text, {language} = this;
    try {
      const {faults} = await ask('check_translation', {text: this.document.disk, language, translation});
      if (translation !== this.as_text || language !== this.language) return;
      for (const pair of this.table.querySelectorAll('.pair')) {
        const area = pair.querySelector('textarea'), place = pair.querySelector('.fault');
        const own = missing && !this.translated.has(area.dataset.key) ? [] : faults.filter(({pointer}) => pointer === `/${area.dataset.key.replace(/~/g, '~0').replace(/\//g, '~1')}`);
        place.textContent = own.map(({text}) => text).join(' ');
        place.hidden = own.length === 0;
        area.setAttribute('aria-invalid', own.length ? 'true' : 'false');
      }
    } catch {
      // The protocol has faults of its own, or the program has gone: the page says so.
    }
  }

  async save() {
    const text = this.as_text;
    try {
      const {sha256} = await ask('save_translation', {language: this.language, text, sha256: this.sha256});
      Object.assign(this, {sha256, is_changed: false, stray: []});
      this.translated = new Map(Object.entries(JSON.parse(text)));
      this.#count();
      this.words.textContent += '; saved';
    } catch (error) {
      if (!(error instanceof Refused) || !error.found) {
        this.words.textContent = `Not saved: ${error.message}`;
        return;
      }
      const answer = await choose('The translation has changed', [element('p', {text: `${error.message} Nothing was written.`})], [['mine', 'Replace it by this page\u2019s'], ['theirs', 'Take the file\u2019s'], ['', 'Not now']]);
      if (answer === 'mine') {
        this.sha256 = error.found.sha256;
        await this.save();
      } else if (answer === 'theirs') {
        const {language} = this;
        Object.assign(this, {language: '', is_changed: false});
        await this.open(language);
      }
    }
  }
}
