// Edits of the text that follow the schema: a member set or removed, and what a decision (shape, task, kind) makes of
// the members beside it.

import {node_at, parse, replaced, with_item, with_member, without_member} from './json_text.js';
import {schema_at, type_of} from './schema.js';

/** JSON of a value in one line, as people write it: {"name": "cone", "radius_m": 0.03}. */
export function written(value) {
  const type = type_of(value);
  if (type === 'array') return `[${value.map(written).join(', ')}]`;
  if (type === 'object') return `{${Object.entries(value).map(([key, inner]) => `${JSON.stringify(key)}: ${written(inner)}`).join(', ')}}`;
  return JSON.stringify(value);
}

/** Sets a member of the object at a path to JSON text; `''` as text removes it. */
export function set_member(text, path, key, json) {
  const object = node_at(parse(text), path);
  const member = object.members.find(one => one.key === key);
  if (json === '') return member ? without_member(text, object, key) : text;
  return member ? replaced(text, member.value, json) : with_member(text, object, key, json);
}

const kMostRounds = 30;
// Of the level that the stimulus has now: where to begin, not what is right.
const kOfLevel = {min: 0.5, max: 2, start: 1.5, low: 0.5, high: 2, step: 0.1, turn: 0.05};
const kLevels = {levels: [0.5, 0.7, 0.85, 1, 1.15, 1.3, 1.5], starts: [0.6, 1.4], steps: [0.4, 0.2, 0.1], threshold: [0.7, 0.85, 1, 1.15, 1.3], values: [0.7, 1, 1.3]};
const round = number => Number(number.toPrecision(3));

/** A value that follows from the level; undefined: none does. */
function around_level(key, level) {
  if (level === undefined || level === 0) return undefined;
  if (key in kOfLevel) return round(kOfLevel[key] * level);
  return kLevels[key]?.map(part => round(part * level));
}

// Of parameters of functions over several dimensions, likewise.
const kOfForm = {w: [0.05, 0.1, 0.2, 0.4], c: [0], a: [0.5, 0.75, 1], b: [0], slope: [0.05, 0.1, 0.2]};

/** Of what stands in place of one level where several numbers vary together; undefined: nothing does. */
function of_dimensions(key, {dimensions}) {
  const by_name = make => Object.fromEntries(dimensions.map(({name, level = 1}) => [name, make(level)]));
  if (key === 'grid') return by_name(level => around_level('threshold', level) ?? [0, 1]);
  if (key === 'ranges') return by_name(level => ({min: around_level('min', level) ?? 0, max: around_level('max', level) ?? 1}));
  if (key === 'function') return {form: dimensions.some(one => one.of === 'standard') ? 'weber' : 'threshold_line'};
  if (key === 's') return [0.05, 0.1, 0.2].map(part => round(part * (dimensions.at(-1).level ?? 1)));
  return kOfForm[key];
}

/** Names that a new value may refer to: without one it would begin with a fault. */
export function initial_of(schema, key, context) {
  const value = schema.initial(key);
  const together = context?.dimensions?.length ? of_dimensions(key, context) : undefined;
  if (together !== undefined) return together;
  if (context && key === 'stimuli' && Array.isArray(value)) return context.stimuli.slice(0, Math.max(1, value.length));
  if (context && (key === 'standard' || key === 'absent')) return context.stimuli[0] ?? '';
  if (context && around_level(key, context.level) !== undefined) return around_level(key, context.level);
  if (key === 'guess') return 0.5;
  if (key === 'level' && context?.levels.length) return {path: context.levels.find(path => /stiffness|radius|edge/.test(path)) ?? context.levels[0]};
  return value;
}

/** Which of several sets of members to begin with: points by dimensions only where there are some. */
function chosen(choice, context) {
  const grid = choice.find(keys => keys[0] === 'grid');
  if (!grid) return choice.at(-1);
  return context?.dimensions?.length ? grid : choice.find(keys => keys !== grid);
}

/**
 * Makes the object at a path consistent with its schema: removes members that do not belong to its decisions, adds
 * those that they need. `before`: the members that were known before the decision; others stay, as faults.
 */
export function settle(text, schema_of, path, before, context) {
  for (let round = 0; round < kMostRounds; ++round) {
    const values = JSON.parse(text), root = schema_of(values.version);
    const object = path.reduce((value, step) => value[step], values);
    const {properties, required, choices, open} = schema_at(root, values, path).members(object);
    const stray = open ? undefined : Object.keys(object).find(key => before.has(key) && !properties.has(key));
    if (stray !== undefined) {
      text = set_member(text, path, stray, '');
      continue;
    }
    // Ranges say what else an asker needs.
    const ranges = context?.dimensions?.length && object.kind === 'ask' && !('ranges' in object) ? 'ranges' : undefined;
    const missing = ranges ?? [...required].find(key => !(key in object) && properties.has(key));
    const choice = choices.find(list => list.length > 1 && list.filter(keys => keys.every(key => key in object)).length !== 1);
    if (missing !== undefined) {
      text = set_member(text, path, missing, written(initial_of(properties.get(missing), missing, context)));
    } else if (choice) {
      const held = choice.filter(keys => keys.every(key => key in object));
      if (held.length > 1) text = set_member(text, path, held[1][0], '');
      else {
        const [key] = 'level' in object && choice.some(keys => keys[0] === 'procedure') ? ['procedure'] : chosen(choice, context);
        text = set_member(text, path, key, written(initial_of(properties.get(key), key, context)));
      }
    } else {
      break;
    }
  }
  return settle_within(text, schema_of, path, before, context);
}

/** The same of objects that the object holds, after a decision about it. */
function settle_within(text, schema_of, path, before, context) {
  if (before.size === 0) return text;
  const object = path.reduce((value, step) => value[step], JSON.parse(text));
  for (const [key, value] of Object.entries(object))
    if (type_of(value) === 'object' && key !== 'keys') text = settle(text, schema_of, [...path, key], new Set(Object.keys(value)), context);
  return text;
}

/** Sets an enumerated member and lets the object follow. */
export function decide(text, schema_of, path, key, json, context) {
  const values = JSON.parse(text);
  const object = path.reduce((value, step) => value[step], values);
  const before = new Set(schema_at(schema_of(values.version), values, path).members(object).properties.keys());
  // Keys stand for the answers of a task; without them they are 1, 2, ...
  if (key === 'task') text = set_member(text, path, 'keys', '');
  text = settle(set_member(text, path, key, json), schema_of, path, before, context);
  if (key !== 'form') return text;
  // The form of a function says which parameters stand beside it.
  const beside = path.slice(0, -1), holder = beside.reduce((value, step) => value[step], values);
  return settle(text, schema_of, beside, new Set(Object.keys(holder)), context);
}

/**
 * Lets two numbers of a level vary in place of one, and its block's procedure choose both. `naming`: of a text, see
 * Form.naming.
 */
export function vary_together(text, schema_of, path, context, naming) {
  const level = path.reduce((value, step) => value[step], JSON.parse(text));
  const pointer = level.path ?? context.levels[0] ?? '', others = context.levels.filter(one => one !== pointer);
  const named = one => one.split('/').findLast(step => !/^\d+$/.test(step))?.replaceAll('_', '-') ?? '';
  const first = context.has_standard ? {name: `standard-${named(pointer)}`, path: pointer, of: 'standard'} : undefined;
  const dimensions = first ? [first, {name: named(pointer), path: pointer}]
    : [pointer, others[0] ?? ''].map(one => ({name: named(one), path: one}));
  for (const key of ['path', 'axis']) text = set_member(text, path, key, '');
  text = set_member(text, path, 'dimensions', written(dimensions));
  const block = path.slice(0, -1), {procedure} = block.reduce((value, step) => value[step], JSON.parse(text));
  if (type_of(procedure) !== 'object') return text;
  const kind = ['constant', 'quest_plus', 'ask'].includes(procedure.kind) ? procedure.kind : 'constant';
  return settle(set_member(text, block, 'procedure', written({kind})), schema_of, [...block, 'procedure'], new Set(), naming(text));
}

/** Adds a value to the list of the object at a path, and the list where there is none. */
export function add_item(text, path, key, value) {
  const object = node_at(parse(text), path), member = object.members.find(one => one.key === key);
  return member ? with_item(text, member.value, written(value)) : with_member(text, object, key, `[${written(value)}]`);
}
