// The protocol as text, with the numbers of lines and a mark at each fault.

import {element} from './dom.js';

const kIndent = '  ';

export class TextView {
  constructor(document) {
    this.document = document;
    this.faults = [];
    this.lines = element('div');
    this.area = element('textarea', {
      spellcheck: 'false', autocapitalize: 'off', autocomplete: 'off', wrap: 'off', 'aria-label': 'Text of the protocol',
      oninput: () => document.edit(this.area.value, 'typing'), onscroll: () => this.#follow(), onkeydown: event => this.#key(event),
    });
    this.root = element('div', {},
        element('div', {class: 'text'}, element('pre', {class: 'gutter', 'aria-hidden': 'true'}, this.lines), this.area),
        element('p', {class: 'soft', text: 'Escape, then Tab, leaves the text.'}));
  }

  show() {
    if (this.area.value !== this.document.text) this.#put(this.document.text);
    this.#number();
  }

  /** Replaces the text; the caret goes to the end of what has changed. */
  #put(text) {
    const before = this.area.value;
    let same = 0;
    const least = Math.min(before.length, text.length);
    while (same < least && before[before.length - 1 - same] === text[text.length - 1 - same]) ++same;
    const {scrollTop, scrollLeft} = this.area;
    const first = before === '';
    this.area.value = text;
    this.area.setSelectionRange(...(first ? [0, 0] : [text.length - same, text.length - same]));
    this.area.scrollTo(scrollLeft, scrollTop);
  }

  mark(faults) {
    this.faults = faults;
    this.#number();
  }

  #number() {
    const texts = new Map();
    for (const {line, text} of this.faults)
      if (line) texts.set(line, texts.has(line) ? `${texts.get(line)}\n${text}` : text);
    const count = this.document.text.split('\n').length;
    const parts = [];
    let plain = '';
    for (let line = 1; line <= count; ++line) {
      if (texts.has(line)) {
        parts.push(plain, element('b', {text: String(line), title: texts.get(line)}), '\n');
        plain = '';
      } else {
        plain += `${line}\n`;
      }
    }
    this.lines.replaceChildren(...parts, plain);
    this.#follow();
  }
  #follow() {
    this.lines.style.transform = `translateY(${-this.area.scrollTop}px)`;
  }

  /** Tab indents, until Escape has given it back to the page. */
  #key(event) {
    if (event.key === 'Escape') this.leaves = true;
    else if (event.key !== 'Tab') this.leaves = false;
    else if (!this.leaves && !event.shiftKey && !event.ctrlKey && !event.altKey) {
      event.preventDefault();
      const {selectionStart: from, selectionEnd: to} = this.area;
      this.area.setRangeText(kIndent, from, to, 'end');
      this.document.edit(this.area.value, 'typing');
    }
  }

  /** Selects a line and brings it into view. */
  go_to_line(line) {
    const lines = this.document.text.split('\n');
    const from = lines.slice(0, line - 1).reduce((sum, one) => sum + one.length + 1, 0);
    this.area.focus();
    this.area.setSelectionRange(from, from + (lines[line - 1] ?? '').length);
    const height = this.area.scrollHeight / lines.length;
    this.area.scrollTop = Math.max(0, (line - 1) * height - this.area.clientHeight / 3);
    this.area.scrollLeft = 0;
  }
}
