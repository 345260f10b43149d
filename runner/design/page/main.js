// palpate design: a page to write, look at and rehearse a protocol.

import {CheckLoop} from './check_loop.js';
import {Document} from './document.js';
import {Form} from './form.js';
import {OrderView} from './order_view.js';
import {PartView, kParts, part_of} from './parts_view.js';
import {PictureView} from './picture_view.js';
import {RehearseView} from './rehearse_view.js';
import {TextView} from './text_view.js';
import {TranslationView} from './translation_view.js';
import {ask, on_connection} from './server.js';
import {by_id, element} from './dom.js';
import {choose_template} from './start_view.js';
import {load_schemas} from './schema.js';
import {save} from './save.js';
import {show_check, show_data, show_failure} from './check_view.js';

function banner(words) {
  by_id('banner').textContent = words;
  by_id('banner').hidden = words === '';
}

class Page {
  constructor(opened, schema_of) {
    this.document = new Document(opened);
    this.form = new Form(this.document, schema_of);
    this.views = new Map([
      ...kParts.map(part => [part.name, {title: part.title, part, view: new PartView(this.form, part)}]),
      ['text', {title: 'The file', view: new TextView(this.document)}],
      ['order', {title: 'Order of a participant', view: new OrderView(this.document)}],
      ['translations', {title: 'Translations', view: new TranslationView(this.document)}],
      ['rehearse', {title: 'Rehearse', view: new RehearseView(this.document)}],
    ]);
    this.picture = new PictureView();
    this.checks = new CheckLoop(this.document, {
      checked: (check, values) => this.#checked(check, values),
      failed: why => show_failure(why),
      known: (data, values) => show_data(data, values),
      pictured: (picture, values) => this.picture.show(picture, Array.isArray(values?.stimuli) ? values.stimuli : []),
    });
    this.#listen();
    by_id('file').textContent = opened.name;
    by_id('file').title = opened.path;
    document.title = `${opened.name} - palpate design`;
    by_id('work').hidden = false;
    this.#outline();
    this.go(this.form.read() ? 'stimuli' : 'text');
    this.#state();
    this.checks.begin();
  }

  #outline() {
    by_id('outline').replaceChildren(...[...this.views].flatMap(([name, {title}]) => [
      name === 'text' ? element('hr') : null,
      element('button', {type: 'button', 'data-view': name, onclick: () => this.go(name)}, element('span', {text: title})),
    ].filter(Boolean)));
    this.#fit_outline();
  }
  /** Parts that a protocol of this version has. */
  #fit_outline() {
    const version = this.form.read() ? this.form.values.version : undefined;
    for (const button of by_id('outline').querySelectorAll('button')) {
      const {part} = this.views.get(button.dataset.view);
      button.hidden = part?.version === 2 && version === 1;
    }
  }

  go(name) {
    this.shown = name;
    const {view} = this.views.get(name);
    for (const button of by_id('outline').querySelectorAll('button')) {
      if (button.dataset.view === name) button.setAttribute('aria-current', 'page');
      else button.removeAttribute('aria-current');
    }
    by_id('view').replaceChildren(view.root);
    view.show();
  }

  #listen() {
    this.document.listen(() => {
      this.#state();
      this.#fit_outline();
      // The focus moves first: a form that is built again gives it back to where it then is.
      if (!this.form.quiet) setTimeout(() => this.views.get(this.shown)?.view.show(), 0);
      this.checks.begin();
    });
    by_id('undo').addEventListener('click', () => this.document.undo());
    by_id('redo').addEventListener('click', () => this.document.redo());
    by_id('save').addEventListener('click', () => this.save());
    addEventListener('beforeunload', event => {
      if (!this.document.is_saved) event.preventDefault();
    });
    addEventListener('keydown', event => this.#key(event));
    on_connection(is_there => banner(is_there ? '' : 'palpate design has ended. This page keeps your text: start it again and open the new address, or copy the text from here.'));
  }

  #key(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    const key = event.key.toLowerCase();
    if (key === 's') {
      event.preventDefault();
      this.save();
    } else if (key === 'z' || key === 'y') {
      // A field that is being typed in has a history of its own.
      if (event.target.matches?.('input, textarea') && event.target !== this.views.get('text').view.area) return;
      event.preventDefault();
      if (key === 'y' || event.shiftKey) this.document.redo();
      else this.document.undo();
    }
  }

  #state() {
    const {document} = this;
    const kind = document.exists ? '' : ', a new file';
    by_id('saved').textContent = document.is_saved ? 'saved' : `not saved yet${kind}`;
    by_id('save').disabled = document.is_saved;
    by_id('undo').disabled = !document.can_undo;
    by_id('redo').disabled = !document.can_redo;
  }

  async save() {
    if (this.saving) return;
    this.saving = true;
    const focused = document.activeElement;
    // What is typed in a field may not have been taken yet.
    if (by_id('view').contains(focused) && focused.matches('input[type="text"], textarea')) focused.dispatchEvent(new Event('change'));
    try {
      const {renamings} = this.document;
      const words = this.document.is_saved ? '' : await save(this.document, this.checks.faults);
      if (this.document.is_saved) await this.views.get('translations').view.renamed(renamings);
      if (words) by_id('saved').textContent = words;
    } catch (error) {
      by_id('saved').textContent = `Not saved: ${error.message}`;
    }
    this.saving = false;
    if (focused?.isConnected) focused.focus();
  }

  #checked(check, values) {
    show_check(check, values, fault => this.#go_to(fault));
    this.views.get('text').view.mark(check.faults);
    for (const [name, {part, view}] of this.views) {
      if (!part) continue;
      const own = check.faults.filter(({pointer}) => pointer.startsWith('/') && part_of(pointer) === name);
      view.mark(own);
      const button = by_id('outline').querySelector(`[data-view="${name}"]`);
      button.querySelector('.count')?.remove();
      if (own.length) button.append(element('span', {class: 'count', title: 'faults', text: String(own.length)}));
    }
  }

  /** Shows a fault where it is looked at: at its field, or in its line. */
  #go_to(fault) {
    if (this.shown === 'text' || !fault.pointer.startsWith('/') || !this.form.read()) {
      this.go('text');
      if (fault.line) this.views.get('text').view.go_to_line(fault.line);
      return;
    }
    const name = part_of(fault.pointer);
    this.go(name);
    this.views.get(name).view.go_to_fault(fault);
  }
}

async function begin() {
  const [opened, schema_of] = await Promise.all([ask('open'), load_schemas()]);
  let text = null;
  if (!opened.exists) text = await choose_template(opened);
  const page = new Page(opened, schema_of);
  if (text !== null) page.document.edit(text);
  // Gives access to the page from the browser's console, and to tests.
  window.design = page;
}

begin().catch(error => banner(error.message));
