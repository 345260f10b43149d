// A JSON text with the place of every value, so that an edit replaces the characters of one value alone.
// A path is a list of keys and indices.

const kDeepest = 200;

/** A text that is not JSON; `at` is the place of the first fault. */
export class NotJson extends Error {
  constructor(at, expected) {
    super(`expected ${expected}`);
    this.at = at;
  }
}

/**
 * The value of a text: {kind, start, end}, of an object with `members`: [{key, start, end, value}], of an array with
 * `items`; `duplicate` where a key is there twice. \throws NotJson
 */
export function parse(text) {
  let at = 0;
  const spaces = /[ \t\n\r]*/y, number = /-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?/y;
  // eslint-disable-next-line no-control-regex
  const string = /"(?:[^"\\\u0000-\u001f]|\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4}))*"/y;
  const skip = () => {
    spaces.lastIndex = at;
    spaces.exec(text);
    at = spaces.lastIndex;
  };
  const take = (pattern, expected) => {
    pattern.lastIndex = at;
    if (!pattern.test(text)) throw new NotJson(at, expected);
    const start = at;
    at = pattern.lastIndex;
    return start;
  };
  const need = (sign, expected) => {
    if (text[at] !== sign) throw new NotJson(at, expected);
    ++at;
  };
  function list(close, depth, read) {
    const found = [];
    ++at;
    skip();
    if (text[at] === close) {
      ++at;
      return found;
    }
    for (;;) {
      found.push(read());
      skip();
      if (text[at] === close) break;
      need(',', `, or ${close}`);
      skip();
    }
    ++at;
    return found;
  }
  function value(depth) {
    if (depth > kDeepest) throw new NotJson(at, 'less depth');
    const start = at;
    if (text[at] === '{') {
      const known = new Set();
      let duplicate = false;
      const members = list('}', depth, () => {
        const from = take(string, 'a key');
        const key = JSON.parse(text.slice(from, at));
        duplicate ||= known.has(key);
        known.add(key);
        skip();
        need(':', ':');
        skip();
        const inner = value(depth + 1);
        return {key, start: from, end: inner.end, value: inner};
      });
      return {kind: 'object', start, end: at, members, duplicate};
    }
    if (text[at] === '[') {
      const items = list(']', depth, () => value(depth + 1));
      return {kind: 'array', start, end: at, items};
    }
    if (text[at] === '"') {
      take(string, 'the end of a text');
      return {kind: 'string', start, end: at};
    }
    for (const word of ['true', 'false', 'null']) {
      if (!text.startsWith(word, at)) continue;
      at += word.length;
      return {kind: word === 'null' ? 'null' : 'boolean', start, end: at};
    }
    take(number, 'a value');
    return {kind: 'number', start, end: at};
  }
  skip();
  const root = value(0);
  skip();
  if (at < text.length) throw new NotJson(at, 'the end of the text');
  return root;
}

/** Whether an object in it has a key twice: a form could show only one of them. */
export function has_duplicates(node) {
  if (node.kind === 'object') return node.duplicate || node.members.some(member => has_duplicates(member.value));
  return node.kind === 'array' && node.items.some(has_duplicates);
}

export const member_of = (node, key) => node?.kind === 'object' ? node.members.find(member => member.key === key) : undefined;

/** The value at a path; undefined: there is none. */
export function node_at(root, path) {
  return path.reduce((node, step) => node?.kind === 'array' ? node.items[step] : member_of(node, step)?.value, root);
}

/** The value as JavaScript has it. */
export const value_of = (text, node) => node === undefined ? undefined : JSON.parse(text.slice(node.start, node.end));

/** "/stimuli/0/radius_m" as a path; numbers where there are lists. */
export function path_of_pointer(root, pointer) {
  const path = [];
  let node = root;
  for (const token of pointer.split('/').slice(1)) {
    const key = token.replace(/~1/g, '/').replace(/~0/g, '~');
    const step = node?.kind === 'array' && /^\d+$/.test(key) ? Number(key) : key;
    node = node && node_at(node, [step]);
    path.push(step);
  }
  return path;
}
export const pointer_of_path = path => path.map(step => '/' + String(step).replace(/~/g, '~0').replace(/\//g, '~1')).join('');

/** An id of an element for a pointer: without the spaces that part ids in attributes. */
export const id_of = (kind, pointer) => `${kind}${pointer.replaceAll('%', '%25').replace(/\s/g, space => `%${space.charCodeAt(0).toString(16)}`)}`;

// ---- edits: each returns the new text -----------------------------------------------------------

const splice = (text, start, end, by) => text.slice(0, start) + by + text.slice(end);

/** The white space at the begin of the line of a place. */
function indent_at(text, at) {
  return /^[ \t]*/.exec(text.slice(text.lastIndexOf('\n', at - 1) + 1))[0];
}
const is_on_lines = (text, node, first) => text.slice(node.start, first).includes('\n');

/** Replaces a value by JSON text. */
export function replaced(text, node, by) {
  return text.slice(node.start, node.end) === by ? text : splice(text, node.start, node.end, by);
}

/** Puts an entry into a list or an object: before the entry `index`, or at its end. */
function put_entry(text, node, entries, entry, index) {
  if (entries.length === 0) {
    const inner = text.slice(node.start + 1, node.end - 1);
    if (!inner.includes('\n')) return splice(text, node.start + 1, node.end - 1, entry);
    const indent = indent_at(text, node.start);
    return splice(text, node.start + 1, node.end - 1, `\n${indent}  ${entry}\n${indent}`);
  }
  // A row of short entries goes on in its last line; else a line of its own.
  const next = entries[index], last = entries[entries.length - 1];
  const near = next ?? last;
  const own_line = is_on_lines(text, node, entries[0].start) && /^[ \t]*$/.test(text.slice(text.lastIndexOf('\n', near.start - 1) + 1, near.start));
  const gap = own_line ? '\n' + indent_at(text, near.start) : ' ';
  return next ? splice(text, next.start, next.start, `${entry},${gap}`) : splice(text, last.end, last.end, `,${gap}${entry}`);
}

/** Adds a member at the end of an object, or before that of the key `before`. */
export function with_member(text, object, key, value, before) {
  const index = object.members.findIndex(member => member.key === before);
  return put_entry(text, object, object.members, `${JSON.stringify(key)}: ${value}`, index);
}
/** Adds an element before that of an index, or at the end. */
export function with_item(text, array, value, index = -1) {
  return put_entry(text, array, array.items, value, index);
}

/** Removes an entry with its comma. */
function without_entry(text, node, entries, index) {
  if (entries.length === 1) return splice(text, node.start + 1, node.end - 1, '');
  if (index + 1 < entries.length) return splice(text, entries[index].start, entries[index + 1].start, '');
  return splice(text, entries[index - 1].end, entries[index].end, '');
}
export function without_member(text, object, key) {
  return without_entry(text, object, object.members, object.members.findIndex(member => member.key === key));
}
export function without_item(text, array, index) {
  return without_entry(text, array, array.items, index);
}

/** Exchanges two elements, character for character. */
export function with_exchanged(text, array, i, j) {
  const [first, second] = [array.items[Math.min(i, j)], array.items[Math.max(i, j)]];
  return text.slice(0, first.start) + text.slice(second.start, second.end) + text.slice(first.end, second.start) +
      text.slice(first.start, first.end) + text.slice(second.end);
}

/** The line of a place, from 1. */
export const line_of = (text, at) => text.slice(0, at).split('\n').length;
