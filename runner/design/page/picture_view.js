// The stimuli at one scale beside the stylus. Dragging or the arrow keys turn each about its own centre.

import {by_id, element} from './dom.js';
import {extent_of, put_dot, put_field, put_rod, put_waves} from './solids.js';
import {label_of, value_in_words} from './units.js';

const {add, sub, times, size, frame, joined, surface_of, axes_of, painter, kLight, kDark} = palpate_drawing;
const kGap = 0.14;    // of the largest stimulus
const kFoot = 34;     // px below a row, for names
const kHead = 26;     // px above all, for the scale
const kOutOfSound = 1.37;  // of the surface, as far as the waves of its sound
const kFieldAlone = 0.03, kOutOf = 1.4;  // m, of a field without a place; of the surface that it has
const kGhost = 0.45;  // opacity of what is seen and not felt
const kLeastLabel = 34;  // px of a cell that has room for a name
const dark = matchMedia('(prefers-color-scheme: dark)');

function members_in_words(part) {
  return Object.entries(part).map(([key, value]) => {
    if (Array.isArray(value) && value.some(one => typeof one === 'object' && !Array.isArray(one)))
      return `${label_of(key)} (${value.map(one => members_in_words(one ?? {})).join('; ')})`;
    return typeof value === 'object' && !Array.isArray(value) ? '' : `${label_of(key)} ${value_in_words(key, value)}`;
  }).filter(Boolean).join(', ');
}

/** What a picture cannot show of a stimulus: its texture, fields, knock, layers, what is seen of it. */
export function stimulus_in_words(stimulus) {
  const words = [];
  const told = (name, part) => {
    if (part !== null && typeof part === 'object') words.push(`${name}: ${members_in_words(part)}`);
  };
  told('texture', stimulus.texture);
  for (const field of stimulus.fields ?? []) told('field', field);
  for (const layer of stimulus.layers ?? []) told('layer', layer);
  told('knock', stimulus.contact_transient);
  for (const [name, key] of [['moves', 'body'], ['gives', 'soft'], ['seen', 'seen'], ['sound', 'sound']]) told(name, stimulus[key]);
  if (stimulus.felt === false) words.push('not felt');
  for (const key of ['stiffness_n_per_m', 'friction_static']) {
    const value = stimulus.material?.[key] ?? stimulus[key];
    if (value !== undefined) words.push(`${label_of(key)} ${value_in_words(key, value)}`);
  }
  return words;
}

const mm = metres => +(1000 * metres).toPrecision(3);
/** The middle of the box about points. */
function middle_of(points) {
  const ends = pick => [0, 1, 2].map(k => points.reduce((v, p) => pick(v, p[k]), points[0]?.[k] ?? 0));
  return times(0.5, add(ends(Math.min), ends(Math.max)));
}

/** What is drawn of a stimulus about its centre: surfaces of one colour each. `sounds`: whether its contacts are heard. */
function parts_of({corners = [], triangles = [], marks, fields = []}, {colour, opacity, sounds} = {}) {
  const centre = middle_of(corners), own = corners.map(p => sub(p, centre)), reach = own.reduce((r, p) => Math.max(r, size(p)), 0);
  const out = fields.some(field => extent_of(field) === 0) ? kOutOf : 1;
  const radius = Math.max((sounds ? kOutOfSound : out) * reach, out * reach, ...fields.map(extent_of), reach === 0 && fields.length ? kFieldAlone : 0);
  const parts = own.length ? [{mesh: surface_of(own, triangles), colour, opacity}] : [];
  const put = (colour_of, fill, origin = centre) => {
    const out = [];
    fill(out);
    for (let i = 0; i < out.length; i += 6) [0, 1, 2].forEach(k => out[i + k] -= origin[k]);
    if (out.length) parts.push({mesh: {vertices: new Float32Array(out)}, colour: colour_of});
  };
  put('virtual', out => {
    marks?.lines.forEach(([a, b]) => put_rod(out, a, b, 0.006 * reach));
    marks?.dots.forEach(at => put_dot(out, at, 0.015 * reach));
  });
  put('force', out => fields.forEach(field => put_field(out, field, radius)));
  if (sounds && reach > 0) put('ideal', out => put_waves(out, reach), [0, 0, 0]);
  return {parts, radius};
}

/** The places of movements, about their middle: the start, the ways and the targets. */
function parts_of_movements({home_m, home_radius_m, targets_m, target_radius_m}) {
  const all = [home_m, ...targets_m], centre = middle_of(all), about = all.map(at => sub(at, centre));
  const [home, ...targets] = about, radius = Math.max(...about.map(size)) + Math.max(home_radius_m, target_radius_m);
  const ways = [], marks = [];
  put_dot(ways, home, home_radius_m);
  for (const target of targets) {
    put_rod(ways, home, target, 0.01 * radius);
    put_dot(marks, target, target_radius_m);
  }
  return {radius, parts: [{mesh: {vertices: new Float32Array(ways)}, colour: 'virtual'}, {mesh: {vertices: new Float32Array(marks)}, colour: 'ideal'}]};
}

/** "from its start to 2 targets, 80 mm away and 10 mm wide" */
function movements_in_words({home_m, targets_m, target_radius_m}) {
  const far = [...new Set(targets_m.map(at => mm(size(sub(at, home_m)))))].sort((a, b) => a - b);
  return `from its start to ${targets_m.length} ${targets_m.length === 1 ? 'target' : 'targets'}, ${far.join(', ')} mm away and ${mm(2 * target_radius_m)} mm wide`;
}

/** The last key of a JSON pointer: "size_m" of "/size_m/0". */
const key_of = path => path.split('/').filter(part => part && !/^\d+$/.test(part)).at(-1) ?? path;
/** The key of a number that levels vary: a turn is in degrees. */
const varied_key = path => (path === '/orientation' ? 'turn_deg' : key_of(path));
/** "size 20 mm", of such a number. */
function number_in_words({name, path, value, least, most}) {
  const key = varied_key(path);
  const [from, to] = [value ?? least, value ?? most].map(one => value_in_words(key, one));
  return `${name?.replaceAll('_', ' ') ?? label_of(key)} ${from === to ? from : `${from} to ${to}`}`;
}

/** "varied: radius 20 mm to 30 mm (practice, size)": the levels of a stimulus, blocks with the same levels together. */
function levels_in_words(varied = []) {
  const blocks = new Map();
  for (const {block, group, numbers} of varied) {
    const words = numbers.map(number_in_words).join(', ');
    blocks.set(words, [...blocks.get(words) ?? [], group ? `${block} of group ${group}` : block]);
  }
  return [...blocks].map(([words, of]) => `varied: ${words} (${of.join(', ')})`);
}

const in_mm = metres => metres.map(mm).join(' × ') + ' mm';

export class PictureView {
  constructor() {
    this.root = by_id('picture');
    this.canvas = this.root.querySelector('canvas');
    this.labels = this.root.querySelector('.labels');
    this.turn = {yaw: -0.5, pitch: 0.42};
    this.stage = {camera: {yaw: 0, pitch: 0, zoom: 1}, radius: 0.08, centre: [0, 0, 0], metres_a_newton: 0.02, colours: () => (dark.matches ? kDark : kLight)};
    this.paint = painter(this.canvas, this.stage);
    this.shapes = [];
    if (!this.paint) this.root.querySelector('.stage').hidden = true;
    this.#listen();
  }

  #listen() {
    const redraw = () => requestAnimationFrame(() => this.draw());
    dark.addEventListener('change', redraw);
    new ResizeObserver(redraw).observe(this.canvas);
    const turn = (yaw, pitch) => {
      this.turn.yaw += yaw;
      this.turn.pitch = Math.min(Math.max(this.turn.pitch + pitch, -1.57), 1.57);
      redraw();
    };
    this.canvas.addEventListener('pointerdown', event => this.canvas.setPointerCapture(event.pointerId));
    this.canvas.addEventListener('pointermove', event => event.buttons && turn(-0.008 * event.movementX, 0.008 * event.movementY));
    this.canvas.addEventListener('keydown', event => {
      const by = {ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[event.key];
      if (!by) return;
      event.preventDefault();
      turn(...by);
    });
  }

  /** Shows an answer of "picture". `written`: the stimuli of the file, for what a picture cannot show. */
  show({stimuli, movements, stylus}, written) {
    const of_file = new Map(written.map(one => [one?.name, one ?? {}]));
    this.shapes = stimuli.flatMap(one => {
      const sounds = Boolean((one.written ?? of_file.get(one.name))?.sound);
      const at = one.at?.map(number_in_words).join(', '), name = [one.name, one.group, at].filter(Boolean).join(', ');
      const turn = one.turn_wxyz && frame([0, 0, 0, ...one.turn_wxyz]);
      return [{name, label: one.at?.map(({path, value}) => value_in_words(varied_key(path), value)).join(', '), size: one.size_m, turn, ...parts_of(one, {sounds})},
        ...(one.seen ? [{name: `${name}, as seen`, label: 'as seen', size: one.seen.size_m, turn, ...parts_of(one.seen, {colour: 'ideal', opacity: kGhost})}] : [])];
    }).filter(one => one.parts.length > 0);
    for (const {blocks, places} of movements) this.shapes.push({name: `movements, ${blocks.join(', ')}`, label: 'movements', ...parts_of_movements(places)});
    this.stylus = stylus;
    this.root.querySelector('.sizes').replaceChildren(...stimuli.map(one => {
      const words = [one.size_m ? in_mm(one.size_m) : 'no surface'];
      if (one.at) words.unshift(one.at.map(number_in_words).join(', '));
      else words.push(...stimulus_in_words(one.written ?? of_file.get(one.name) ?? {}), ...levels_in_words(one.varied));
      if (one.seen) words.push(`seen as ${in_mm(one.seen.size_m)}`);
      if (one.marks?.every > 1) words.push(`every ${one.marks.every}th ridge is drawn`);
      if (one.all_triangles) words.push(`drawn with ${one.triangles.length} of its ${one.all_triangles} triangles`);
      return element('li', {}, element('b', {text: one.group ? `${one.name}, group ${one.group}` : one.name}), ` ${words.join('; ')}`);
    }), ...movements.map(({blocks, places}) => element('li', {}, element('b', {text: 'movements'}), ` ${movements_in_words(places)} (${blocks.join(', ')})`)));
    const note = this.root.querySelector('.note');
    note.hidden = Boolean(this.paint);
    note.textContent = 'This browser has no WebGL: sizes in words.';
    this.canvas.setAttribute('aria-label', `Stimuli at true scale beside the stylus: ${this.shapes.map(one => (one.size ? `${one.name} ${in_mm(one.size)}` : one.name)).join(', ')}. Drag, or the arrow keys, to turn them.`);
    this.draw();
  }

  /** Rows of cells as wide as the largest stimulus, and the stylus at the right. */
  #layout(width, height) {
    const largest = Math.max(...this.shapes.map(one => one.radius), 1e-4);
    const cell = 2 * largest * (1 + kGap), reach = this.stylus.reach ?? 1;
    const long = this.stylus.length_m * Math.max(1, reach);
    let best = null;
    for (let columns = 1; columns <= Math.max(1, this.shapes.length); ++columns) {
      const rows = Math.max(1, Math.ceil(this.shapes.length / columns));
      const w = columns * cell + 0.6 * cell;
      const scale = Math.min(width / w, (height - kHead - rows * kFoot) / Math.max(rows * cell, long * (rows === 1 ? 1 : 1.02)));
      if (!best || scale > best.scale) best = {columns, rows, scale, cell, long, w};
    }
    return best;
  }

  draw() {
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (!this.paint || !this.stylus || width === 0) return;
    const {columns, rows, scale, cell, long, w} = this.#layout(width, height);
    this.stage.radius = height / (3.4 * scale);
    const down = kHead / scale / 2;  // m, of all, to leave room for the scale
    const to_px = ([x, , z]) => [width / 2 + x * scale, height / 2 - z * scale];
    const {right, into, up} = axes_of(this.turn);
    const column = k => [right[k], into[k], up[k]];
    const turned = {x: column(0), y: column(1), z: column(2)};
    const labels = [], objects = [];
    const row_height = Math.max(cell + kFoot / scale, rows === 1 ? long + 16 / scale : 0);
    this.shapes.forEach((shape, i) => {
      const row = Math.floor(i / columns), in_row = Math.min(columns, this.shapes.length - row * columns);
      const o = [-w / 2 + cell * (0.5 + (i % columns) + (columns - in_row) / 2), 0, ((rows - 1) / 2 - row) * row_height + kFoot / scale / 2 - down];
      const object = shape.turn ? joined({...turned, o}, shape.turn) : {...turned, o};
      shape.parts.forEach(part => objects.push({...part, object}));
      const [x, y] = to_px([o[0], 0, o[2] - shape.radius]);
      if (cell * scale < kLeastLabel) return;
      labels.push(element('span', {text: shape.label ?? shape.name, title: shape.name}));
      labels.at(-1).style.maxWidth = `${cell * scale}px`;
      place(labels.at(-1), x, Math.min(y + 2, height - 18));
    });
    const foot = [w / 2 - 0.3 * cell, 0, -long / 2 + kFoot / scale / 2 - down];
    const at = z => add(foot, [0, 0, z]);
    const segments = this.stylus.segments?.map(([a, b]) => [add(foot, a), add(foot, b)]) ?? [[at(0), at(long)]];
    objects.sort((a, b) => (b.opacity ?? 1) - (a.opacity ?? 1));  // what shines through is drawn last
    this.paint({objects, mesh: null, virtual: [], ideal: segments, contact: null, force: [0, 0, 0]});
    const [x, y] = to_px(foot);
    const reach = this.stylus.reach && this.stylus.reach !== 1 ? `, ×${this.stylus.reach}` : '';
    labels.push(element('span', {text: `stylus${reach}`}));
    place(labels.at(-1), Math.min(x, width - 30), Math.min(y + 6, height - 18));
    labels.push(scale_bar(scale, width));
    this.labels.replaceChildren(...labels);
  }
}

function place(label, x, y) {
  label.style.left = `${x}px`;
  label.style.top = `${y}px`;
}

/** A round length of at most a quarter of the width. */
function scale_bar(scale, width) {
  const most = 0.25 * width / scale, power = 10 ** Math.floor(Math.log10(most));
  const length = [5, 2, 1].map(n => n * power).find(one => one <= most) ?? power;
  const bar = element('span', {class: 'scale'}, element('b', {text: length < 1 ? `${+(1000 * length).toPrecision(2)} mm` : `${length} m`}));
  bar.style.left = '10px';
  bar.style.top = '22px';
  bar.style.width = `${length * scale}px`;
  return bar;
}
