// The parts of a protocol in the outline: fields of the whole, and lists of stimuli, blocks, pages, one entry at a time.

import {element} from './dom.js';
import {value_control} from './controls.js';
import {free_name} from './references.js';
import {node_at, parse, pointer_of_path, with_exchanged, with_item, without_item} from './json_text.js';
import {add_item, settle, written} from './decisions.js';
import {mesh_place} from './mesh_file.js';
import {with_focus_kept} from './form.js';

// What stands in the outline: members of the protocol, and a list among them that is shown one entry at a time.
export const kParts = [
  {name: 'study', title: 'Study', keys: ['name', 'title', 'description', 'version', 'renderers', 'renderer_order', 'repetitions', 'orientation', 'order', 'blocks_per_renderer', 'practice',
    'sessions', 'breaks', 'samples', 'seed', 'torque', 'material', 'masking_noise', '$schema']},
  {name: 'stimuli', title: 'Stimuli', list: 'stimuli', one: 'stimulus', keys: []},
  {name: 'blocks', title: 'Blocks', list: 'blocks', one: 'block', keys: ['block_order'], version: 2},
  {name: 'groups', title: 'Groups, factors', keys: ['groups', 'factors', 'tests', 'cues'], version: 2},
  {name: 'answers', title: 'Answers', keys: ['response', 'responses', 'sounds', 'codes']},
  {name: 'pages', title: 'Pages', list: 'pages', one: 'page', keys: [], version: 2},
  {name: 'texts', title: 'Texts', keys: ['texts']},
  {name: 'space', title: 'Space, device', keys: ['stylus', 'workspace', 'tool', 'reach', 'view', 'gravity_m_per_s2', 'servo', 'home']},
];
const kPlaced = new Set(kParts.flatMap(part => [part.list, ...part.keys]));

/** The part that a fault's pointer is shown in. */
export function part_of(pointer) {
  const key = pointer.split('/')[1] ?? '';
  return (kParts.find(part => part.list === key || part.keys.includes(key)) ?? kParts[0]).name;
}

const fault_place = () => element('p', {class: 'fault', hidden: true});

export class PartView {
  constructor(form, part) {
    Object.assign(this, {form, part, shown: 0});
    this.root = element('div', {class: 'form'});
    this.mesh = part.list === 'stimuli' ? mesh_place(form, index => this.shown = index) : null;
    this.faults = [];
  }

  show() {
    const {form} = this;
    with_focus_kept(this.root, form.focus, () => this.#build());
    form.focus = undefined;
    form.mark(this.root, this.faults);
  }
  mark(faults) {
    this.faults = faults;
    this.form.mark(this.root, faults);
    this.#count();
  }

  #build() {
    try {
      this.#fill();
    } catch (error) {
      console.error(error);
      this.root.replaceChildren(element('div', {class: 'card'}, element('h3', {text: this.part.title}),
          element('p', {text: `No form can show this: ${error.message}. The file shows it.`})));
    }
  }
  #fill() {
    const {form, part} = this;
    if (!form.read()) {
      this.root.replaceChildren(element('div', {class: 'card'}, element('h3', {text: part.title}),
          element('p', {text: `${form.unreadable} Mend it in The file; a form shows it then.`})));
      return;
    }
    const context = form.context(), keys = this.#keys();
    const fields = keys.length ? element('div', {class: 'card'}, element('h3', {text: part.list ? 'Of all' : part.title}), form.members(context, [], form.schema, keys)) : null;
    const has_fields = fields?.querySelector('.row');
    this.root.replaceChildren(...[part.list ? this.#list(context) : null, has_fields ? fields : null].filter(Boolean));
    this.#count();
  }

  /** Members of this part; what stands in no part is in the first. */
  #keys() {
    const known = this.form.schema.members(this.form.values).properties;
    const stray = this.part.name === 'study' ? Object.keys(this.form.values).filter(key => !kPlaced.has(key)) : [];
    const more = this.part.name === 'study' ? [...known.keys()].filter(key => !kPlaced.has(key)) : [];
    return [...this.part.keys.filter(key => known.has(key) || key in this.form.values), ...stray, ...more];
  }

  #list(context) {
    const {form, part} = this, path = [part.list], all = form.values[part.list];
    if (all !== undefined && !Array.isArray(all)) return element('div', {class: 'card'}, element('p', {text: `${part.title}: expected a list; mend it in The file.`}));
    const entries = all ?? [];
    this.shown = Math.max(0, Math.min(this.shown, entries.length - 1));
    const tabs = entries.map((entry, i) => element('button', {type: 'button', class: 'tab', 'aria-pressed': i === this.shown ? 'true' : 'false', 'data-index': String(i),
      'data-pointer': `${pointer_of_path(path)}#tab${i}`, text: entry?.name || `${part.one} ${i + 1}`, onclick: () => this.go_to(i)}));
    const add = element('button', {type: 'button', text: `Add a ${part.one}`, 'data-pointer': `${pointer_of_path(path)}#add`, onclick: () => this.#add()});
    return element('div', {class: 'entries', 'data-row': pointer_of_path(path)}, element('div', {class: 'tabs', role: 'group', 'aria-label': part.title}, ...tabs, add), fault_place(),
        entries.length ? this.#entry(context, [part.list, this.shown], entries) : null, this.mesh?.place);
  }

  #entry(context, path, entries) {
    const i = path[1], name = entries[i]?.name || `${this.part.one} ${i + 1}`;
    const button = (text, label, what, disabled) => element('button', {type: 'button', text, 'aria-label': label, 'data-pointer': `${pointer_of_path(path)}#${what}`,
      disabled, onclick: () => this.#change(what)});
    return element('div', {class: 'card', 'data-row': pointer_of_path(path)}, element('div', {class: 'bar'}, element('h3', {text: name}), element('span', {class: 'space'}),
        button('\u2191', `Move ${name} to the front`, 'up', i === 0), button('\u2193', `Move ${name} to the back`, 'down', i === entries.length - 1),
        button('Copy', `Copy ${name}`, 'copy'), button('Remove', `Remove ${name}`, 'remove')), fault_place(),
    value_control(context, path, this.form.schema_at(path)));
  }

  go_to(index) {
    this.shown = index;
    with_focus_kept(this.root, undefined, () => this.#build());
    this.form.mark(this.root, this.faults);
  }

  #add() {
    const {form, part} = this, {text} = form.document;
    const entries = form.values[part.list] ?? [], names = entries.map(one => one?.name);
    const schema = form.schema_at([part.list, entries.length]);
    const value = schema.initial();
    const draft = {name: free_name(names, part.one), ...value};
    draft.name = free_name(names, part.one);
    let made = add_item(text, [], part.list, draft);
    const path = [part.list, entries.length];
    const naming = form.naming(path);
    if (part.list === 'blocks') {
      draft.stimuli = naming.stimuli;
      made = settle(add_item(text, [], part.list, draft), form.schema_of, path, new Set(), naming);
    }
    this.shown = entries.length;
    form.rebuild(made, [...path, 'name']);
  }

  #change(what) {
    const {form, part} = this, {text} = form.document, i = this.shown;
    const list = node_at(parse(text), [part.list]);
    const entries = form.values[part.list];
    if (what === 'up' || what === 'down') {
      const j = what === 'up' ? i - 1 : i + 1;
      this.shown = j;
      form.rebuild(with_exchanged(text, list, i, j), undefined);
    } else if (what === 'copy') {
      const item = list.items[i], name = free_name(entries.map(one => one?.name), entries[i]?.name ?? part.one);
      const copied = text.slice(item.start, item.end), node = node_at(parse(copied), ['name']);
      const made = node ? copied.slice(0, node.start) + written(name) + copied.slice(node.end) : copied;
      this.shown = i + 1;
      form.rebuild(with_item(text, list, made, i + 1), [part.list, i + 1, 'name']);
    } else {
      this.shown = Math.max(0, i - 1);
      form.rebuild(without_item(text, list, i), undefined);
    }
  }

  /** The faults of each entry, at its tab. */
  #count() {
    for (const tab of this.root.querySelectorAll('.tab')) {
      const own = this.faults.filter(({pointer}) => `${pointer}/`.startsWith(`/${this.part.list}/${tab.dataset.index}/`)).length;
      tab.querySelector('.count')?.remove();
      if (own) tab.append(element('span', {class: 'count', title: 'faults', text: String(own)}));
    }
  }

  /** Shows the field of a fault and gives it the focus. */
  go_to_fault({pointer}) {
    const steps = pointer.split('/');
    if (this.part.list && steps[1] === this.part.list && /^\d+$/.test(steps[2] ?? '')) this.go_to(Number(steps[2]));
    for (let at = pointer; at !== ''; at = at.slice(0, Math.max(0, at.lastIndexOf('/')))) {
      const control = this.root.querySelector(`[data-pointer="${CSS.escape(at)}"]`);
      if (!control) continue;
      (control.matches('input, select, textarea, button') ? control : control.querySelector('input, select, textarea, button'))?.focus();
      return;
    }
  }
}
