// Where a protocol names its stimuli, blocks, factors and groups: for choices, and to rename them all at once.

import {node_at, parse, replaced, value_of} from './json_text.js';

// Patterns of pointers: * is any one step. "keys": the names are keys of the object there.
const kPlaces = {
  stimuli: ['/blocks/*/stimuli/*', '/blocks/*/standard', '/blocks/*/absent', '/blocks/*/keys/*', '/blocks/*/keys/*/answer',
    '/response/keys/*', '/response/keys/*/stimulus'],
  blocks: ['/pages/*/block', '/cues/haptic', '/cues/visual', '/cues/both/*'],
  factors: ['/blocks/*/factors/*'],
};
const kKeys = {
  factors: ['/blocks/*/factors'],
  groups: ['/groups/patch'],
};
const kValues = {groups: ['/groups/names/*']};

function is_like(pattern, path) {
  const steps = pattern.split('/').slice(1);
  return steps.length === path.length && steps.every((step, i) => step === '*' || step === path[i]);
}

/** What a text at a path names: "stimuli", "blocks", "factors"; null: nothing. A group's patch counts as the protocol. */
export function named_at(path) {
  const own = path[0] === 'groups' && path[1] === 'patch' ? path.slice(3) : path;
  return Object.keys(kPlaces).find(kind => kPlaces[kind].some(pattern => is_like(pattern, own))) ?? null;
}

/** Names of that kind in a protocol. */
export function names_of(values, kind) {
  const list = Array.isArray(values?.[kind]) ? values[kind] : [];
  return list.map(one => one?.name).filter(name => typeof name === 'string');
}

/** "ball" in "/stimuli/ball/radius_m", "surface" in "surface * group": a name within a text. */
function within(kind, path, written, from, to) {
  if (kind === 'stimuli' && path[0] === 'factors') {
    const steps = written.split('/');
    if (steps[1] === 'stimuli' && steps[2] === from) return ['', 'stimuli', to, ...steps.slice(3)].join('/');
  }
  if (kind === 'factors' && path[0] === 'tests') {
    const parts = written.split(/(\s*[*x:]\s*)/);
    return parts.map(part => (part === from ? to : part)).join('');
  }
  return written;
}

/** The text with a name and every reference to it replaced. `path`: of the name, ["stimuli", 1, "name"]. */
export function renamed(text, path, to) {
  const root = parse(text), own = node_at(root, path), from = value_of(text, own);
  const kind = path[0] === 'groups' ? 'groups' : path[0];
  const edits = [[own, JSON.stringify(to)]];
  const key_node = member => ({start: member.start, end: text.indexOf('"', member.start + 1) + 1});
  function visit(node, at) {
    const plain = at[0] === 'groups' && at[1] === 'patch' && at.length > 3 ? at.slice(3) : at;
    if (node.kind === 'string') {
      const value = value_of(text, node);
      const names = [...(kPlaces[kind] ?? []), ...(kValues[kind] ?? [])].some(pattern => is_like(pattern, plain));
      const now = names ? (value === from ? to : value) : within(kind, plain, value, from, to);
      if (now !== value && node !== own) edits.push([node, JSON.stringify(now)]);
    }
    node.members?.forEach(member => {
      const is_name = kKeys[kind]?.some(pattern => is_like(pattern, plain)) && member.key === from;
      const now = is_name ? to : plain[plain.length - 1] === 'set' ? within(kind, plain, member.key, from, to) : member.key;
      if (now !== member.key) edits.push([key_node(member), JSON.stringify(now)]);
      visit(member.value, [...at, member.key]);
    });
    node.items?.forEach((item, i) => visit(item, [...at, i]));
  }
  visit(root, []);
  // Only one node may stand for a name twice, where a name is also its own reference.
  const seen = new Set();
  return edits.filter(([node]) => !seen.has(node.start) && seen.add(node.start))
      .sort(([a], [b]) => b.start - a.start).reduce((now, [node, by]) => replaced(now, node, by), text);
}

/** The numbers of a stimulus as pointers, for what a block varies. */
export function levels_of(stimulus) {
  const out = [];
  (function visit(value, pointer) {
    if (typeof value === 'number' && pointer !== '') out.push(pointer);
    else if (value !== null && typeof value === 'object')
      for (const [key, inner] of Object.entries(value)) visit(inner, `${pointer}/${key}`);
  })(stimulus, '');
  return out.length > 40 ? out.slice(0, 40) : out;
}

/** What a level of a factor may set: pointers to values of stimuli, of all or of one, and to keys of blocks. */
export function settable(values) {
  const out = new Set(), stimuli = Array.isArray(values.stimuli) ? values.stimuli : [];
  const numbers = stimuli.map(one => (one === null || typeof one !== 'object' ? [] : levels_of({...values.material, ...one})));
  const all = numbers.flat();
  all.filter((one, i) => all.indexOf(one) === i).forEach(pointer => out.add(`/stimuli/*${pointer}`));
  stimuli.forEach((one, i) => numbers[i].forEach(pointer => out.add(`/stimuli/${one.name}${pointer}`)));
  for (const key of ['repetitions', 'feedback', 'question', 'instructions', 'time_out_s', 'interval_limit_s', 'inter_interval_s']) out.add(`/block/${key}`);
  return [...out];
}

/** A name that is not taken: "ball-2". */
export function free_name(names, wanted) {
  const stem = wanted.replace(/-\d+$/, '');
  if (!names.includes(wanted)) return wanted;
  let n = 2;
  while (names.includes(`${stem}-${n}`)) ++n;
  return `${stem}-${n}`;
}

