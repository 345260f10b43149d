// Controls of the form: one for each value of the text. A control replaces the characters of its value alone.

import {element} from './dom.js';
import {id_of, node_at, parse, pointer_of_path, replaced, with_exchanged, with_item, without_item} from './json_text.js';
import {decide, set_member, written} from './decisions.js';
import {label_of, shown_number, unit_of, written_number} from './units.js';
import {named_at, names_of, settable} from './references.js';
import {patch_schema, set_schema, type_of} from './schema.js';

const kLongTexts = new Set(['description', 'instructions', 'text', 'question', 'practice', 'break', 'end']);
const kTypes = {boolean: 'yes or no', number: 'a number', string: 'a word', array: 'a list', object: 'in detail', null: 'none'};
const kCounts = {object: 'one', array: 'several'};

export const title_of = key => {
  const name = typeof key === 'number' ? String(key + 1) : label_of(key);
  return name.charAt(0).toUpperCase() + name.slice(1);
};

/** What the controls need: the document, its parsed text and values, and what the form does. */
export class Context {
  constructor(form) {
    this.form = form;
    this.document = form.document;
  }
  get values() {
    this.form.read();
    return this.form.values;
  }
  get root() {
    this.form.read();
    return this.form.root;
  }
  /** An edit that changes no other control. */
  replace(path, json) {
    const {text} = this.document, node = node_at(parse(text), path);
    if (node) this.form.edit(replaced(text, node, json), pointer_of_path(path));
  }
  /** An edit after which the form is built again. */
  rebuild(text, focus) {
    this.form.rebuild(text, focus);
  }
  get text() {
    return this.document.text;
  }
  raw(path) {
    const node = node_at(this.root, path);
    return node === undefined ? '' : this.document.text.slice(node.start, node.end);
  }
  value(path) {
    return path.reduce((value, step) => value?.[step], this.values);
  }
}

/** Attributes by which the form finds a control again, and its fault. */
const known = (path, more = {}) => ({'data-pointer': pointer_of_path(path), id: id_of('field', pointer_of_path(path)), ...more});

function number_control(context, path, schema) {
  const key = [...path].reverse().find(step => typeof step === 'string') ?? '';
  const unit_key = context.form.unit_key(path, key), {unit} = unit_of(unit_key);
  const value = context.value(path), raw = context.raw(path);
  const shown = type_of(value) === 'number' ? shown_number(unit_key, raw) : value === null ? '' : typeof value === 'string' ? value : raw;
  const may_be_none = [schema.json.type].flat().includes('null');
  let touched = false;
  const put = (text, is_final) => {
    if (!touched) return;
    const plain = written_number(unit_key, text);
    if (plain !== null) context.replace(path, plain);
    else if (text.trim() === '' && may_be_none) context.replace(path, 'null');
    else if (is_final) context.replace(path, JSON.stringify(text));
  };
  const input = element('input', known(path, {type: 'text', inputmode: 'decimal', class: 'number', value: shown, placeholder: may_be_none ? 'none' : null,
    oninput: () => {
      touched = true;
      put(input.value, false);
    }, onchange: () => put(input.value, true)}));
  return unit ? element('span', {class: 'with-unit'}, input, element('span', {class: 'unit', text: unit})) : input;
}

function text_control(context, path, key) {
  const value = context.value(path), long = kLongTexts.has(key) || String(value).length > 60;
  const input = element(long ? 'textarea' : 'input', known(path, {type: long ? null : 'text', rows: long ? '3' : null, spellcheck: long ? null : 'false',
    oninput: () => context.replace(path, JSON.stringify(input.value))}));
  input.value = value;
  return input;
}

/** A name of the protocol: it renames every reference when it is done. */
function name_control(context, path) {
  const value = context.value(path);
  const input = element('input', known(path, {type: 'text', spellcheck: 'false', value, onchange: () => context.form.rename(path, input.value.trim())}));
  return input;
}

function select_control(context, path, choices, key, on_change) {
  const value = context.value(path);
  const all = choices.includes(value) ? choices : [value, ...choices];
  const select = element('select', known(path, {onchange: () => on_change(all[select.selectedIndex])}),
      ...all.map(one => element('option', {text: one === null ? 'none' : String(one), selected: one === value})));
  return select;
}

function choice_control(context, path, schema) {
  const parent = path.slice(0, -1), key = path.at(-1), choices = schema.json.enum;
  return select_control(context, path, choices, key, one => {
    const json = JSON.stringify(one);
    if (typeof key === 'number') context.replace(path, json);
    else context.rebuild(decide(context.text, context.form.schema_of, parent, key, json, context.form.naming(parent)), path);
  });
}

/** Several of some words: in the order in which they are chosen. */
function choices_control(context, path, choices) {
  const value = context.value(path);
  const words = [...choices, ...value.filter(one => !choices.includes(one))];
  return element('span', {class: 'choices', role: 'group', 'aria-label': title_of(path.at(-1)), ...known(path)}, ...words.map(one => {
    const box = element('input', {type: 'checkbox', checked: value.includes(one), 'data-pointer': `${pointer_of_path(path)}#${one}`, onchange: () => {
      const {text} = context, list = node_at(parse(text), path);
      const at = context.value(path).indexOf(one);
      context.rebuild(at < 0 ? with_item(text, list, JSON.stringify(one)) : without_item(text, list, at), null);
    }});
    return element('label', {}, box, String(one));
  }));
}

/** Numbers, or rows of numbers, in one line: "0, 0, 25 mm". */
function numbers_control(context, path) {
  const key = context.form.unit_key(path, [...path].reverse().find(step => typeof step === 'string') ?? ''), {unit} = unit_of(key);
  const node = node_at(context.root, path);
  const shown = node.items.map(item => shown_number(key, context.document.text.slice(item.start, item.end))).join(', ');
  const input = element('input', known(path, {type: 'text', value: shown, class: 'numbers', onchange: () => {
    const words = input.value.split(/[,;]\s*|\s+/).filter(Boolean);
    if (input.value === input.defaultValue) return;
    const numbers = words.map(word => written_number(key, word));
    const list = numbers.map((number, i) => number ?? JSON.stringify(words[i])).join(', ');
    context.replace(path, `[${list}]`);
  }}));
  return unit ? element('span', {class: 'with-unit'}, input, element('span', {class: 'unit', text: unit})) : input;
}

/** Any JSON: what no other control is for. */
function json_control(context, path) {
  const raw = context.raw(path);
  const input = element('textarea', known(path, {rows: String(Math.min(8, raw.split('\n').length + 1)), class: 'json', spellcheck: 'false', onchange: () => {
    if (input.value === raw) return;
    try {
      parse(input.value);
      context.rebuild(replaced(context.text, node_at(parse(context.text), path), input.value.trim()), path);
    } catch {
      context.replace(path, JSON.stringify(input.value));
    }
  }}));
  input.value = raw;
  return input;
}

function list_control(context, path, items) {
  const value = context.value(path);
  const list = () => node_at(parse(context.text), path);
  const labelled = i => {
    const control = value_control(context, [...path, i], items);
    const input = control.matches('input, textarea, select') ? control : control.matches('.with-unit') ? control.firstChild : null;
    input?.setAttribute('aria-label', `${title_of(path.at(-1))} ${i + 1}`);
    return control;
  };
  return element('div', {class: 'list', ...known(path)}, ...value.map((_, i) => element('div', {class: 'entry'},
      labelled(i),
      element('span', {class: 'tools'},
          i > 0 ? element('button', {type: 'button', 'aria-label': `Move ${title_of(path.at(-1))} ${i + 1} up`, text: '\u2191', 'data-pointer': `${pointer_of_path(path)}#up${i}`,
            onclick: () => context.rebuild(with_exchanged(context.text, list(), i - 1, i), null)}) : null,
          element('button', {type: 'button', 'aria-label': `Remove ${title_of(path.at(-1))} ${i + 1}`, text: '\u00d7', 'data-pointer': `${pointer_of_path(path)}#remove${i}`,
            onclick: () => context.rebuild(without_item(context.text, list(), i), null)})))),
  element('button', {type: 'button', text: `Add to ${title_of(path.at(-1)).toLowerCase()}`, 'data-pointer': `${pointer_of_path(path)}#add`,
    onclick: () => context.rebuild(with_item(context.text, list(), written(items.initial(String(path.at(-1))))), [...path, value.length])}));
}

function array_control(context, path, schema) {
  const value = context.value(path), items = schema.of(schema.json.items ?? {}), inner = items.resolved();
  const kind = named_at([...path, 0]);
  if (kind) return choices_control(context, path, names_of(context.values, kind));
  if (inner.json.enum) return choices_control(context, path, inner.json.enum);
  if (value.length > 0 && value.every(one => ['number', 'string'].includes(typeof one)) && items.branches().some(one => one.value_type() === 'number'))
    return numbers_control(context, path);
  if (inner.value_type() === 'number') return numbers_control(context, path);
  return list_control(context, path, items);
}

/** Entries with keys of their own: answers by key, levels by pointer. */
function map_control(context, path, open) {
  const keys = Object.keys(context.value(path));
  const fresh = element('input', {type: 'text', 'aria-label': `New key of ${title_of(path.at(-1))}`, placeholder: 'key', 'data-pointer': `${pointer_of_path(path)}#key`});
  return element('div', {class: 'list', ...known(path)}, ...keys.map(key => element('div', {class: 'entry'},
      element('label', {class: 'key', for: id_of('field', pointer_of_path([...path, key])), text: key}), value_control(context, [...path, key], open),
      element('span', {class: 'tools'}, element('button', {type: 'button', 'aria-label': `Remove ${key}`, text: '\u00d7', 'data-pointer': `${pointer_of_path(path)}#remove${key}`,
        onclick: () => context.rebuild(set_member(context.text, path, key, ''), null)})))),
  element('span', {class: 'entry'}, fresh, element('button', {type: 'button', text: 'Add', 'data-pointer': `${pointer_of_path(path)}#add`, onclick: () => {
    if (fresh.value && !keys.includes(fresh.value)) context.rebuild(set_member(context.text, path, fresh.value, written(open.initial(fresh.value))), [...path, fresh.value]);
  }})));
}

/** A row for each entry, and a choice that adds one. `entry(key)`: the control of its key; `added(key)`: its JSON. */
function rows_control(context, path, {entry, inner, choices, label, added}) {
  const keys = Object.keys(context.value(path)), free = choices.filter(one => !keys.includes(one));
  const put = key => context.rebuild(set_member(context.text, path, key, added(key)), [...path, key]);
  const choice = element('select', {class: 'more', 'aria-label': label, 'data-pointer': `${pointer_of_path(path)}#add`, onchange: () => choice.selectedIndex > 0 && put(free[choice.selectedIndex - 1])},
      element('option', {text: `${label} \u2026`}), ...free.map(text => element('option', {text})));
  return element('div', {class: 'list', ...known(path)}, ...keys.map(key => element('div', {class: 'entry'}, entry(key), inner(key),
      element('span', {class: 'tools'}, element('button', {type: 'button', 'aria-label': `Remove ${key}`, text: '\u00d7', 'data-pointer': `${pointer_of_path(path)}#remove${key}`,
        onclick: () => context.rebuild(set_member(context.text, path, key, ''), null)})))), free.length ? choice : null);
}

/** What a level of a factor sets: a pointer, which is chosen or typed, and a value as what it points to has it. */
function set_control(context, path) {
  const {form} = context, all = settable(context.values), list = element('datalist', {id: id_of('settable', pointer_of_path(path))}, ...all.map(value => element('option', {value})));
  const schema = key => set_schema(form.schema, context.values, key) ?? form.schema.of({});
  const now = key => {
    const [, kind, name, ...rest] = key.split('/');
    const stimuli = context.values.stimuli ?? [], own = kind === 'stimuli' ? (name === '*' ? stimuli : stimuli.filter(one => one?.name === name)) : [];
    const found = own.map(one => rest.reduce((value, step) => value?.[step], {...context.values.material, ...one})).find(one => one !== undefined);
    return written(found ?? schema(key).initial(key.split('/').at(-1)));
  };
  const entry = key => element('input', {type: 'text', class: 'key', value: key, list: list.id, spellcheck: 'false', 'aria-label': `Pointer ${key}`, 'data-pointer': `${pointer_of_path([...path, key])}#key`,
    onchange: event => {
      const to = event.target.value.trim(), member = node_at(parse(context.text), path).members.find(one => one.key === key);
      if (to !== '' && to !== key && !(to in context.value(path))) context.rebuild(replaced(context.text, {start: member.start, end: member.start + JSON.stringify(key).length}, JSON.stringify(to)), [...path, to]);
    }});
  const rows = rows_control(context, path, {entry, inner: key => value_control(context, [...path, key], schema(key)), choices: all, label: 'Set a value', added: now});
  rows.append(list);
  return rows;
}

/** What differs for each group: members of the protocol. */
function patch_control(context, path) {
  const {names = []} = context.value(['groups']) ?? {}, schema = patch_schema(context.form.schema);
  return rows_control(context, path, {
    entry: key => element('span', {class: 'key', text: key}), choices: names.map(String), label: 'Let a group differ', added: () => '{}',
    inner: key => (type_of(context.value([...path, key])) === 'object' ? context.form.members(context, [...path, key], schema) : json_control(context, [...path, key])),
  });
}

/** "Given as": another type of value, where there are several. */
function type_control(context, path, schema, branch) {
  const types = new Map(schema.branches().map(one => [one.value_type(), one]));
  if (types.size < 2 || (types.size === 2 && types.has('null'))) return null;
  const own = branch.value_type();
  const select = element('select', {class: 'type', 'aria-label': `Give ${title_of(path.at(-1))} as`, 'data-pointer': `${pointer_of_path(path)}#type`, onchange: () => {
    const chosen = [...types.values()][select.selectedIndex];
    const json = chosen.value_type() === 'array' && type_of(context.value(path)) === chosen.of(chosen.json.items ?? {}).branches()[0]?.value_type() ?
      `[${context.raw(path)}]` : written(chosen.initial(String(path.at(-1))));
    context.rebuild(replaced(context.text, node_at(parse(context.text), path), json), path);
  }}, ...[...types.keys()].map(type => element('option', {text: types.has('object') && types.has('array') ? kCounts[type] ?? kTypes[type] : kTypes[type] ?? type, selected: type === own})));
  return select;
}

function plain_control(context, path, schema, branch) {
  const key = path.at(-1), value = context.value(path), type = type_of(value), wanted = branch.value_type();
  const kind = named_at(path);
  if (key === 'name' && ['stimuli', 'blocks', 'factors', 'pages'].includes(path[0]) && path.length === 3) return name_control(context, path);
  if (key === 'set' && path[0] === 'factors' && type === 'object') return set_control(context, path);
  if (key === 'patch' && path[0] === 'groups' && path.length === 2 && type === 'object') return patch_control(context, path);
  if (type === 'string' && kind) return select_control(context, path, names_of(context.values, kind), key, one => context.replace(path, JSON.stringify(one)));
  if (type === 'string' && key === 'path' && (path.at(-2) === 'level' || path.at(-3) === 'dimensions')) {
    const {levels} = context.form.naming(path);
    return select_control(context, path, [...levels, '/orientation'], key, one => context.rebuild(set_member(context.text, path.slice(0, -1), 'path', JSON.stringify(one)), path));
  }
  if (branch.json.enum && type !== 'object' && type !== 'array') return choice_control(context, path, branch);
  if ('const' in branch.json) return element('output', {class: 'soft', text: String(value), ...known(path)});
  if (type === 'boolean' && wanted === 'boolean')
    return element('input', known(path, {type: 'checkbox', checked: value, onchange: event => context.replace(path, String(event.target.checked))}));
  if (wanted === 'number' && ['number', 'string', 'null'].includes(type)) return number_control(context, path, branch);
  if (type === 'string') return text_control(context, path, key);
  if (type === 'array' && (wanted === 'array' || wanted === undefined) && branch.json.items) return array_control(context, path, branch);
  if (type === 'object' && wanted === 'object') {
    const {properties, open} = schema.members(value);
    if (properties.size > 0) return context.form.members(context, path, schema);
    if (open) return map_control(context, path, open);
  }
  return json_control(context, path);
}

/** The control of a value. */
export function value_control(context, path, schema) {
  const branch = schema.branch_of(context.value(path));
  const type = type_control(context, path, schema, branch);
  const control = plain_control(context, path, schema, branch);
  return type ? element('div', {class: 'typed'}, type, control) : control;
}

