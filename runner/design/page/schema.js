// What the schemas say of a value: its members, which are needed, which do not belong. The schemas only choose the
// fields of the form; the program alone judges.

const kFiles = ['protocol.schema.json', 'protocol.v2.schema.json', 'scene.schema.json'];

export const type_of = value => (value === null ? 'null' : Array.isArray(value) ? 'array' : typeof value);

/** A schema with the file that its references are relative to. */
class Schema {
  constructor(set, file, json) {
    Object.assign(this, {set, file, json});
  }
  of(json) {
    return new Schema(this.set, this.file, json);
  }

  /** The same for a part of such a value: nothing is needed, at any depth. */
  as_part() {
    return Object.assign(this.of(this.json), {is_part: true});
  }

  /** Without a reference: what it refers to, and beside it what stands here. */
  resolved() {
    if (typeof this.json?.$ref !== 'string') return this;
    const {$ref, ...own} = this.json;
    const [file, pointer] = $ref.split('#');
    const name = file || this.file;
    const target = new Schema(this.set, name, pointer.split('/').slice(1).reduce((json, key) => json[key], this.set[name])).resolved();
    return new Schema(this.set, target.file, {...target.json, ...own, outer: this});
  }

  /** Whether a value meets it, as far as conditions need. */
  matches(value) {
    const {json} = this;
    if (typeof json === 'boolean') return json;
    if (json.$ref) return this.resolved().matches(value);
    const type = type_of(value);
    const is = one => one === type || (one === 'integer' && Number.isInteger(value));
    if (json.type && ![json.type].flat().some(is)) return false;
    if ('const' in json && json.const !== value) return false;
    if (json.enum && !json.enum.includes(value)) return false;
    if (type === 'object') {
      if (json.required?.some(key => !(key in value))) return false;
      if (Object.entries(json.properties ?? {}).some(([key, inner]) => key in value && !this.of(inner).matches(value[key]))) return false;
    }
    if (type === 'array') {
      if (json.minItems > value.length) return false;
      if (json.contains && !value.some(item => this.of(json.contains).matches(item))) return false;
    }
    if (json.not && this.of(json.not).matches(value)) return false;
    const all = list => list.map(one => this.of(one).matches(value));
    return !(json.allOf && all(json.allOf).includes(false)) && !(json.anyOf && !all(json.anyOf).includes(true)) &&
        !(json.oneOf && !all(json.oneOf).includes(true));
  }

  /** The kinds of value that it takes: schemas, each of one type. */
  branches() {
    const {json} = this.resolved();
    const own = this.resolved();
    const list = json.oneOf ?? json.anyOf;
    const typed = list?.map(one => own.of(one).resolved()).filter(one => one.json.type || one.json.enum || 'const' in one.json || one.json.oneOf || one.json.anyOf);
    if (!typed?.length || (json.type && json.type !== 'object') || json.properties) return [own];
    return typed.flatMap(one => one.branches());
  }
  /** The branch that a value is of, or the first. */
  branch_of(value) {
    const all = this.branches(), type = type_of(value);
    const typed = all.filter(one => one.value_type() === type);
    return typed.find(one => one.discriminates(value)) ?? typed[0] ?? all[0];
  }
  /** "number", "array", ... */
  value_type() {
    const {json} = this;
    const said = [json.type].flat()[0] ?? (json.enum ? type_of(json.enum[0]) : 'const' in json ? type_of(json.const) : json.properties ? 'object' : undefined);
    return said === 'integer' ? 'number' : said;
  }
  /** Whether the constants of its members are those of a value. */
  discriminates(value) {
    const constant = Object.entries(this.json.properties ?? {}).filter(([, inner]) => inner && 'const' in inner);
    if ('const' in this.json) return this.json.const === value;
    if (this.json.enum) return this.json.enum.includes(value);
    if (Array.isArray(value) && value.length && this.json.items) return this.of(this.json.items).matches(value[0]);
    return constant.every(([key, inner]) => value?.[key] === inner.const);
  }

  /** Of an object with this value: {properties: Map of schemas, required: Set, open: schema of other members}. */
  members(value) {
    const out = {properties: new Map(), required: new Set(), open: null, keys: null, choices: [], description: ''};
    const branches = this.branches().filter(one => one.value_type() === 'object');
    const other = branches.length === 1 && this.branches().length > 1;  // beside a text or a number
    if (branches.length > 1 || other) (other ? branches[0] : this.branch_of(value ?? {})).#collect(value, out);
    else this.#collect(value, out);
    // A member that a branch fixes is one of all branches' choices.
    const consts = new Map();
    for (const branch of branches)
      for (const [key, inner] of Object.entries(branch.json.properties ?? {}))
        if (inner && 'const' in inner) consts.set(key, [...(consts.get(key) ?? []), inner.const]);
    for (const [key, all] of consts)
      if (all.length > 1 && out.properties.has(key)) out.properties.set(key, this.of({description: '', enum: all}));
    if (this.is_part) {
      out.required.clear();
      out.choices = [];
      for (const [key, inner] of out.properties) out.properties.set(key, inner.as_part());
    }
    return out;
  }

  #collect(value, out) {
    const {json} = this;
    if (typeof json !== 'object') return;
    const outer = json.outer;
    if (json.$ref) {
      this.of({$ref: json.$ref}).resolved().#collect(value, out);
      this.of({...json, $ref: undefined}).#collect(value, out);
      return;
    }
    if (outer) {
      this.of({...json, outer: undefined}).#collect(value, out);
      outer.of({...outer.json, $ref: undefined}).#collect(value, out);
      return;
    }
    for (const [key, inner] of Object.entries(json.properties ?? {})) {
      if (inner === false) out.properties.delete(key);
      else if (!out.properties.has(key)) out.properties.set(key, this.of(inner));
      else if (inner !== true) {
        const known = out.properties.get(key);
        const {json: own} = this.of(inner).resolved();
        out.properties.set(key, new Schema(this.set, known.file, {...known.json, ...own}));
      }
    }
    json.required?.forEach(key => out.required.add(key));
    if (typeof json.additionalProperties === 'object') out.open = this.of(json.additionalProperties);
    for (const [key, needed] of Object.entries(json.dependentRequired ?? {}))
      if (key in (value ?? {})) needed.forEach(one => out.required.add(one));
    json.allOf?.forEach(one => this.of(one).#collect(value, out));
    const list = json.oneOf ?? json.anyOf;
    if (list?.every(one => one.properties || one.$ref)) {
      const all = list.map(one => this.of(one).resolved());
      (all.find(one => one.discriminates(value)) ?? all[0]).#collect(value, out);
    } else if (list) out.choices.push(list.filter(one => one.required).map(one => one.required));
    if (json.if) {
      const then = this.of(json.if).matches(value) ? json.then : json.else;
      if (then) this.of(then).#collect(value, out);
    }
  }

  /** A value to begin with, as small as it may be. `name`: the key that it is for. */
  initial(name = '') {
    const branch = this.branches()[0], {json} = branch;
    const own = this.resolved().json;
    const short = Array.isArray(own.default) && own.default.length < (branch.json.minItems ?? own.minItems ?? 0);
    if ('default' in own && own.default !== null && !short) return own.default;
    if ('const' in json) return json.const;
    if (json.enum) return json.enum[0];
    const type = branch.value_type();
    if (type === 'boolean') return true;
    if (type === 'number') return branch.#initial_number(name);
    if (type === 'array') return Array.from({length: json.minItems ?? 1}, () => branch.of(json.items ?? {}).initial(name));
    if (type !== 'object') return '';
    const out = {};
    for (;;) {
      const {properties, required} = this.members(out);
      const missing = [...required].filter(key => !(key in out) && properties.has(key));
      if (missing.length === 0) break;
      // A decision first: it says what else is needed.
      const key = missing.find(one => properties.get(one).resolved().json.enum) ?? missing[0];
      out[key] = properties.get(key).initial(key);
    }
    return out;
  }
  #initial_number(name) {
    const {minimum, exclusiveMinimum, maximum} = this.json;
    const usual = /_m$/.test(name) ? 0.02 : 1;
    const least = minimum ?? exclusiveMinimum ?? usual, most = maximum ?? Infinity;
    const inside = exclusiveMinimum !== undefined && usual <= exclusiveMinimum ? exclusiveMinimum + 1 : Math.max(usual, least);
    return Math.min(inside, most);
  }
}

/** Loads the schemas; a function from the version of a protocol to its schema. */
export async function load_schemas() {
  const set = {};
  for (const file of kFiles) set[file] = await (await fetch(`/${file}`)).json();
  return version => {
    const file = version === 1 ? kFiles[0] : kFiles[1];
    return new Schema(set, file, set[file]);
  };
}

const kNotPatched = ['groups', 'factors', 'tests', 'name', 'version', 'seed', 'cues', '$schema'];

/** Whether a path is of what differs for a group, or within it. */
export const is_patch = path => path[0] === 'groups' && path[1] === 'patch' && path.length >= 3;

/** The schema of what a group may differ in: parts of the protocol. */
export function patch_schema(root) {
  const part = root.as_part(), members = part.members.bind(part);
  part.members = value => {
    const out = members(value);
    kNotPatched.forEach(key => out.properties.delete(key));
    return out;
  };
  return part;
}

/** The schema of what a level of a factor sets; null: the pointer leads nowhere. */
export function set_schema(root, values, pointer) {
  const [, kind, ...steps] = pointer.split('/').map(step => step.replace(/~1/g, '/').replace(/~0/g, '~'));
  const has = path => path.reduce((value, step) => value?.[step], values) !== undefined;
  const rest = (kind === 'stimuli' ? steps.slice(1) : steps).map(step => (/^\d+$/.test(step) ? Number(step) : step));
  const at = (list, wanted) => Math.max(0, (values[list] ?? []).findIndex(wanted));
  const head = kind === 'stimuli' ? ['stimuli', at('stimuli', (one, i) => (steps[0] === '*' ? has(['stimuli', i, ...rest]) : one?.name === steps[0]))] : ['blocks', at('blocks', one => one?.factors)];
  return rest.length ? schema_at(root, values, [...head, ...rest]) : null;
}

/** The schema of the value at a path. */
export function schema_at(root, values, path) {
  const set = path[0] === 'factors' ? path.indexOf('set') : -1;
  if (set > 0 && path.length > set + 1) {
    const own = set_schema(root, values, path[set + 1]);
    if (own) return path.length === set + 2 ? own : schema_at(own, path.slice(0, set + 2).reduce((value, step) => value?.[step], values), path.slice(set + 2));
  }
  let schema = root, value = values;
  if (is_patch(path)) return schema_at(patch_schema(root), values.groups?.patch?.[path[2]], path.slice(3));
  for (const step of path) {
    const branch = schema.branch_of(value);
    if (type_of(value) === 'array') schema = branch.of(branch.json.items ?? {});
    else {
      const {properties, open} = schema.members(value);
      schema = properties.get(step) ?? open ?? branch.of({});
    }
    value = value?.[step];
  }
  return schema;
}
