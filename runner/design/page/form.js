// The form of a part of the protocol, made from the schema: members that are there as fields, the others in a menu.

import {Context, title_of, value_control} from './controls.js';
import {NotJson, has_duplicates, id_of, node_at, parse, pointer_of_path} from './json_text.js';
import {element, by_id} from './dom.js';
import {levels_of, names_of, renamed} from './references.js';
import {is_patch, schema_at} from './schema.js';
import {hint_in_words, unit_of} from './units.js';
import {Recoveries} from './recover_view.js';
import {initial_of, set_member, settle, written, vary_together} from './decisions.js';

const kFirst = ['name', 'title', 'description', 'shape', 'task', 'kind', 'file', 'radius_m', 'height_m', 'edge_m', 'size_m', 'scale', 'stimuli', 'standard', 'level', 'procedure'];
const kLast = ['version', '$schema'];

export class Form {
  constructor(document, schema_of) {
    this.document = document;
    this.schema_of = schema_of;
    this.faults = [];
    this.quiet = false;
    this.recoveries = new Recoveries();
    this.read();
  }

  /** Reads the text; false: a form cannot show it. `this.why` says why. */
  read() {
    this.why = '';
    if (this.read_text === this.document.text) return !this.unreadable;
    this.read_text = this.document.text;
    this.unreadable = '';
    try {
      this.root = parse(this.document.text);
      if (this.root.kind !== 'object') this.unreadable = 'It is no JSON object.';
      else if (has_duplicates(this.root)) this.unreadable = 'A key is there twice.';
      else if (this.document.bom) this.unreadable = 'It begins with a byte order mark.';
      else if (/"__proto__"/.test(this.document.text)) this.unreadable = 'It has a key that no form shows.';
      else this.values = JSON.parse(this.document.text);
    } catch (error) {
      if (!(error instanceof NotJson)) throw error;
      const line = this.document.text.slice(0, error.at).split('\n').length;
      this.unreadable = `Line ${line} is not JSON: ${error.message}.`;
    }
    return !this.unreadable;
  }

  get schema() {
    return this.schema_of(this.values.version);
  }

  /** Changes one value; its control shows it already. */
  edit(text, kind) {
    this.quiet = true;
    this.document.edit(text, kind);
    this.quiet = false;
  }
  /** Changes more: the view is built again. `focus`: the path of the control that then has the focus; null: the same. */
  rebuild(text, focus) {
    this.focus = focus ? pointer_of_path(focus) : undefined;
    this.document.edit(text);
  }

  rename(path, to) {
    const from = path.reduce((value, step) => value[step], this.values);
    if (to === from) return;
    this.focus = undefined;
    this.document.edit(renamed(this.document.text, path, to), '', [path[0], from, to]);
  }

  /** The unit of what a block varies; '': none. */
  unit_of_level(path) {
    return unit_of(this.unit_key(path, 'levels')).unit === 'mm' ? 'm' : unit_of(this.unit_key(path, 'levels')).unit;
  }

  /** Names and numbers that new members of the object at a path may refer to. */
  naming(path, values = this.values) {
    const stimuli = names_of(values, 'stimuli');
    const block = path[0] === 'blocks' ? values.blocks?.[path[1]] : undefined;
    const name = block?.stimuli?.[0] ?? stimuli[0];
    const stimulus = values.stimuli?.find(one => one?.name === name);
    const merged = stimulus && {...values.material, ...stimulus};
    const number_at = pointer => {
      const value = pointer?.split?.('/').slice(1).reduce((inner, step) => inner?.[step], merged);
      return typeof value === 'number' ? value : undefined;
    };
    const listed = block?.level?.dimensions, dimensions = Array.isArray(listed) ? listed.filter(one => one?.name) : [];
    return {stimuli, levels: stimulus ? levels_of(merged) : [], level: number_at(block?.level?.path), has_standard: block?.standard !== undefined,
      dimensions: dimensions.map(one => ({name: one.name, of: one.of, level: number_at(one.path)}))};
  }

  /** The key that says a number's unit: levels have that of the number that varies. */
  unit_key(path, key) {
    if (key.startsWith('/')) return key.split('/').findLast(step => !/^\d+$/.test(step));
    const block = path[0] === 'blocks' ? this.values.blocks?.[path[1]] : undefined;
    const last = pointer => pointer?.split('/').findLast(step => !/^\d+$/.test(step));
    // Values of a dimension, by its name.
    const at = path.findIndex(step => step === 'grid' || step === 'ranges');
    const dimension = at < 0 ? undefined : block?.level?.dimensions?.find(one => one?.name === (path[at + 1] ?? key));
    if (dimension && key !== 'count') return last(dimension.path) ?? key;
    const varied = last(block?.level?.path);
    const of_level = ['levels', 'threshold', 'start', 'starts', 'min', 'max', 'steps', 'step', 'turn', 'low', 'high'];
    // Parts of a range or of weighted values have the unit of the whole.
    const whole = ['from', 'to', 'values'].includes(key) ? path.at(-1) : key;
    if (!varied || !of_level.includes(whole) || block.task === 'rate') return key;
    const procedure = path.includes('procedure') ? path.slice(0, path.indexOf('procedure') + 1).concat(typeof path[path.indexOf('procedure') + 1] === 'number' ? [path[path.indexOf('procedure') + 1]] : []) : null;
    const scale = procedure?.reduce((value, step) => value?.[step], this.values)?.scale;
    const is_ratio = scale && scale !== 'linear' && ['steps', 'step'].includes(key);
    return is_ratio ? key : varied;
  }

  /** The fields of the object at a path. `only`: of these members. */
  members(context, path, schema, only) {
    const value = context.value(path), {properties, required, open} = schema.members(value);
    const mine = key => !only || only.includes(key);
    const order = [...properties.keys()].sort((a, b) => (rank(a) === rank(b) ? 0 : rank(a) - rank(b)));
    const there = [...order.filter(key => key in value), ...Object.keys(value).filter(key => !properties.has(key))].filter(mine);
    const missing = order.filter(key => required.has(key) && !(key in value) && mine(key));
    const rest = order.filter(key => !(key in value) && !required.has(key) && mine(key));
    const own = {class: path.length ? 'members' : 'members top', 'data-members': pointer_of_path(path)};
    return element(path.length ? 'fieldset' : 'div', own,
        path.length ? element('legend', {class: 'hidden', text: title_of(path.at(-1))}) : null,
        ...there.map(key => this.#row(context, path, key, properties.get(key) ?? open, required.has(key), properties.has(key) || Boolean(open))),
        ...missing.map(key => this.#missing(context, path, key, properties.get(key))),
        rest.length ? this.#more(context, path, rest, properties) : null);
  }

  #row(context, path, key, schema, is_required, belongs) {
    const at = [...path, key], pointer = pointer_of_path(at);
    const known = schema ?? this.schema.of({});
    const control = value_control(context, at, known);
    const inner = control.matches('fieldset, .list') || control.querySelector('fieldset, .list') !== null;
    const label = element('label', {class: 'name', for: id_of('field', pointer), text: title_of(key)});
    const remove = is_required ? null : element('button', {type: 'button', class: 'remove', title: `Remove ${title_of(key)}`, 'aria-label': `Remove ${title_of(key)}`,
      'data-pointer': `${pointer}#remove`, text: '\u00d7', onclick: () => this.rebuild(set_member(this.document.text, path, key, ''), null)});
    const words = belongs ? hint_in_words(key, known.resolved().json.description ?? '') : 'This key is unknown here.';
    const hint = words ? element('span', {class: belongs ? 'hint' : 'hint alarm', id: id_of('hint', pointer), text: words}) : null;
    if (key === 'procedure' && path[0] === 'blocks' && path.length === 2) control.append?.(this.recoveries.place(context, at));
    if (hint) control.querySelector?.('input, select, textarea')?.setAttribute('aria-describedby', hint.id);
    return element('div', {class: inner ? 'row wide' : 'row', 'data-row': pointer}, label, control, remove, hint, element('span', {class: 'fault', id: id_of('fault', pointer), hidden: true}));
  }

  #missing(context, path, key, schema) {
    const pointer = pointer_of_path([...path, key]);
    return element('div', {class: 'row', 'data-row': pointer}, element('span', {class: 'name', text: title_of(key)}),
        element('button', {type: 'button', text: `Set ${title_of(key).toLowerCase()}`, 'data-pointer': pointer, onclick: () => this.#set(path, key, schema)}),
        element('span', {class: 'fault', id: id_of('fault', pointer), hidden: true}));
  }

  #more(context, path, keys, properties) {
    const pointer = `${pointer_of_path(path)}#more`;
    const select = element('select', {class: 'more', 'aria-label': path.length ? `Set something else of ${title_of(path.at(-1))}` : 'Set something else', 'data-pointer': pointer,
      onchange: () => select.selectedIndex > 0 && this.#set(path, keys[select.selectedIndex - 1], properties.get(keys[select.selectedIndex - 1]))},
    element('option', {text: 'Set something else \u2026'}),
    ...keys.map(key => {
      const words = hint_in_words(key, properties.get(key).resolved().json.description ?? '');
      return element('option', {text: words ? `${title_of(key)}: ${words.length > 90 ? `${words.slice(0, 88)}\u2026` : words}` : title_of(key)});
    }));
    return element('div', {class: 'row'}, select);
  }

  #set(path, key, schema) {
    const naming = this.naming(path);
    if (key === 'dimensions') {
      this.rebuild(vary_together(this.document.text, this.schema_of, path, naming, text => this.naming(path, JSON.parse(text))), [...path, key]);
      return;
    }
    const draft = set_member(this.document.text, path, key, this.#initial(path, key, schema, naming));
    this.rebuild(settle(draft, this.schema_of, path, new Set(), naming), [...path, key]);
  }

  /** JSON to begin a member with: in a group's patch what the protocol says, which a list replaces as a whole. */
  #initial(path, key, schema, naming) {
    const same = is_patch(path) ? node_at(this.root, [...path.slice(3), key]) : undefined;
    return same && same.kind !== 'object' ? this.document.text.slice(same.start, same.end) : written(is_patch(path) && same ? {} : initial_of(schema, key, naming));
  }

  /** A context of the text as it is now. */
  context() {
    return new Context(this);
  }
  schema_at(path) {
    return schema_at(this.schema, this.values, path);
  }

  /** Marks the fields of faults within an element. */
  mark(root, faults) {
    for (const old of root.querySelectorAll('[aria-invalid]')) old.removeAttribute('aria-invalid');
    for (const old of root.querySelectorAll('.fault')) {
      old.hidden = true;
      old.textContent = '';
    }
    for (const fault of faults) {
      const row = row_of(root, fault.pointer);
      const place = row?.querySelector(':scope > .fault');
      if (!place) continue;
      const is_own = row.dataset.row === fault.pointer;
      const member = fault.pointer.slice(row.dataset.row.length + 1);
      place.textContent += (place.textContent ? ' ' : '') + (is_own ? fault.text : `${in_words(member)}: ${fault.text}`);
      place.hidden = false;
      if (!is_own && row.querySelector('[data-row], .list')) continue;
      const control = row.querySelector('input, select, textarea, button');
      control?.setAttribute('aria-invalid', 'true');
      control?.setAttribute('aria-describedby', place.id);
    }
  }
}

/** "0" as "value 1", "layers/0/depth_m" as "layers, 1, depth". */
function in_words(member) {
  const steps = member.split('/').map(step => (/^\d+$/.test(step) ? String(Number(step) + 1) : title_of(step).toLowerCase()));
  return steps.length === 1 && /^\d+$/.test(steps[0]) ? `Value ${steps[0]}` : steps.join(', ');
}

/** The innermost row of a pointer within an element. */
export function row_of(root, pointer) {
  for (let at = pointer; at !== ''; at = at.slice(0, Math.max(0, at.lastIndexOf('/')))) {
    const row = root.querySelector(`[data-row="${CSS.escape(at)}"]`);
    if (row) return row;
  }
  return null;
}

function rank(key) {
  const at = kFirst.indexOf(key);
  return kLast.includes(key) ? Infinity : at < 0 ? kFirst.length : at;
}

/** Restores the focus after a view was built again. */
export function with_focus_kept(root, wanted, build) {
  const active = document.activeElement;
  const pointer = wanted ?? (root.contains(active) ? active.dataset.pointer : undefined);
  const caret = active?.selectionStart !== undefined && !wanted ? [active.selectionStart, active.selectionEnd] : null;
  build();
  if (pointer === undefined) return;
  const found = root.querySelector(`[data-pointer="${CSS.escape(pointer)}"]`) ?? row_of(root, pointer.split('#')[0]) ?? root;
  const target = found.matches('input, select, textarea, button') ? found : found.querySelector('input, select, textarea, button') ?? by_id('view');
  target.focus();
  try {
    if (caret && target.setSelectionRange) target.setSelectionRange(...caret);
  } catch {
    // A checkbox has no caret.
  }
}
