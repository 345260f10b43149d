// A trial on a page: decodes its ticks and draws them at the time that the reader chooses.
(async () => {
  'use strict';
  const $ = id => document.getElementById(id);
  const given = JSON.parse($('ticks').textContent);
  const kSpeeds = [0.05, 0.1, 0.2, 0.5, 1, 2, 4];
  const {add, sub, times, dot, cross, size, unit, frame, turned, placed, joined, surface_of, painter, kLight,
         kDark} = palpate_drawing;

  // ---- numbers -------------------------------------------------------------------------------

  // Decodes a zlib stream in base64: integers, 7 bits a byte, zigzag, each column as differences.
  async function unpacked(text) {
    const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }
  async function columns(data, specs) {
    const bytes = await unpacked(data);
    let at = 0;
    const out = {};
    for (const [name, count, step, order] of specs) {
      const column = new Float64Array(count);
      const sums = [0, 0, 0, 0];
      for (let i = 0; i < count; ++i) {
        let value = 0, scale = 1, byte;
        do {
          byte = bytes[at++];
          value += (byte & 127) * scale;
          scale *= 128;
        } while (byte > 127);
        sums[order] = value % 2 ? -(value + 1) / 2 : value / 2;
        for (let k = order; k > 0; --k) sums[k - 1] += sums[k];
        column[i] = sums[0] / step;
      }
      out[name] = column;
    }
    return out;
  }

  // ---- meshes --------------------------------------------------------------------------------

  async function mesh_of(given) {
    const c = await columns(given.data, given.columns);
    const triangles = [];
    for (let i = 0; i < c.corner.length; i += 3) triangles.push([c.corner[i], c.corner[i + 1], c.corner[i + 2]]);
    return surface_of(Array.from(c.x, (x, i) => [x, c.y[i], c.z[i]]), triangles);
  }

  // ---- the trial -----------------------------------------------------------------------------

  const meshes = await Promise.all(given.meshes.map(mesh_of));
  const shows = [];
  for (const one of given.shows) {
    const show = {...one, c: await columns(one.data, one.columns)};
    delete show.data;
    if (one.path !== undefined) show.c = {...shows[one.path].c, ...show.c};
    const c = show.c, n = c.t.length;
    // The intervals of a trial are consecutive on one axis of time.
    show.time = new Float64Array(n);
    let first = 0, start = 0;
    for (const part of show.parts) {
      part.first = first;
      part.start = start;
      for (let i = 0; i < part.ticks; ++i) show.time[first + i] = start + c.t[first + i];
      first += part.ticks;
      start = part.ticks ? show.time[first - 1] + given.period : start;
      part.end = first;
    }
    show.magnitude = c.force_x.map((x, i) => Math.hypot(x, c.force_y[i], c.force_z[i]));
    shows.push(show);
  }
  const v3 = (c, name, i) => [c[name + '_x'][i], c[name + '_y'][i], c[name + '_z'][i]];
  function tick(show, i) {
    const c = show.c, part = show.parts.find(p => i < p.end);
    const tip = v3(c, 'tip', i), tail = v3(c, 'tail', i);
    const ideal_tip = add(tip, v3(c, 'lag_tip', i)), ideal_tail = add(add(tail, v3(c, 'lag_tip', i)), v3(c, 'lag_turn', i));
    let object = null;
    if (part.mesh !== null) {
      object = frame(part.pose);
      if (c.moved_x) object = joined(frame([...v3(c, 'moved', i), c.moved_qw[i], c.moved_qx[i], c.moved_qy[i], c.moved_qz[i]]), object);
    }
    const lines = (a, b) => {
      if (!show.tool) return [[a, b]];
      const z = unit(sub(b, a)), s = v3(c, 'side', i), x = unit(sub(s, times(dot(s, z), z)));
      const f = {x, y: cross(z, x), z, o: a};
      return show.tool.map(([from, to]) => [placed(f, from), placed(f, to)]);
    };
    const felt = part.mesh === null ? null : {mesh: meshes[part.mesh], object};
    const seen = part.seen ? {mesh: meshes[part.seen.mesh], object: scaled(frame(part.seen.pose), part.seen.scale)} : null;
    return {
      t: c.t[i], part, felt, seen, objects: [...(felt ? [felt] : []), ...(seen ? [{...seen, colour: 'virtual', opacity: 0.3}] : [])],
      virtual: lines(tip, tail), ideal: lines(ideal_tip, ideal_tail),
      force: v3(c, 'force', i), depth: c.depth[i], contacts: c.contacts[i],
      contact: c.contacts[i] > 0 ? add(ideal_tip, v3(c, 'contact', i)) : null,
      type: given.types[c.type[i]], faults: given.faults.filter(([bit]) => (c.faults[i] & bit) !== 0),
    };
  }

  function scaled(f, by) {
    return {x: times(by, f.x), y: times(by, f.y), z: times(by, f.z), o: f.o};
  }

  // The size of all objects, so that pictures side by side have one scale.
  const outline = [];
  let strongest = 0;
  for (const show of shows) {
    for (const f of show.magnitude) strongest = Math.max(strongest, f);
    for (const part of show.parts) {
      if (part.mesh !== null) {
        const f = frame(part.pose);
        for (const corner of meshes[part.mesh].corners) outline.push(placed(f, corner));
      }
      if (!part.seen) continue;
      const f = scaled(frame(part.seen.pose), part.seen.scale);
      for (const corner of meshes[part.seen.mesh].corners) outline.push(placed(f, corner));
    }
  }
  if (!outline.length) outline.push([-0.03, 0, 0], [0.03, 0, 0]);
  const ends = (pick, k) => outline.reduce((v, p) => pick(v, p[k]), outline[0][k]);
  const centre = [0, 1, 2].map(k => (ends(Math.min, k) + ends(Math.max, k)) / 2);
  const radius = outline.reduce((r, p) => Math.max(r, size(sub(p, centre))), 1e-4);
  const metres_a_newton = strongest > 0 ? 0.9 * radius / strongest : 0;
  const last = Math.max(...shows.map(s => s.time.length ? s.time[s.time.length - 1] : 0));
  const camera = {yaw: -0.5, pitch: 0.42, zoom: 1};
  let now = 0, playing = false, speed = 1, solid = true, printing = false;

  // ---- pictures ------------------------------------------------------------------------------

  const dark = matchMedia('(prefers-color-scheme: dark)');
  const stage = {camera, radius, centre, metres_a_newton, colours: () => dark.matches && !printing ? kDark : kLight};

  const kSvg = 'http://www.w3.org/2000/svg';
  function node(kind, attributes, parent, text) {
    const out = document.createElementNS(kSvg, kind);
    for (const [name, value] of Object.entries(attributes)) out.setAttribute(name, value);
    if (text !== undefined) out.textContent = text;
    if (parent) parent.append(out);
    return out;
  }
  const px = v => v.toFixed(1);

  // Above: from above; below: from the front and from the right.
  const kViews = [
    {name: 'from above', x: 0, y: 0, right: [1, 0, 0], up: [0, 1, 0]},
    {name: 'from the front', x: 0, y: 150, right: [1, 0, 0], up: [0, 0, 1]},
    {name: 'from the right', x: 200, y: 150, right: [0, 1, 0], up: [0, 0, 1]},
  ];
  function three_views(svg, number) {
    svg.setAttribute('viewBox', '0 0 400 300');
    const panels = kViews.map((view, i) => {
      const clip = `clip-${number}-${i}`;
      const defs = node('clipPath', {id: clip}, svg);
      node('rect', {x: view.x, y: view.y, width: 200, height: 150}, defs);
      const g = node('g', {'clip-path': `url(#${clip})`}, svg);
      const out = {view};
      for (const kind of ['object', 'crease', 'seen', 'virtual', 'ideal', 'force'])
        out[kind] = node('path', {class: kind}, g);
      out.contact = node('circle', {class: 'contact', r: 4}, g);
      node('rect', {class: 'frame', x: view.x, y: view.y, width: 200, height: 150}, svg);
      node('text', {x: view.x + 7, y: view.y + 17}, svg, view.name);
      return out;
    });
    const bar = node('path', {class: 'crease'}, svg), words = node('text', {x: 216, y: 112}, svg);
    const arrow = node('path', {class: 'force'}, svg), newtons = node('text', {x: 216, y: 62}, svg);
    let drawn = null;
    return moment => {
      const scale = 45 * camera.zoom / radius;
      const still = drawn === scale + ' ' + moment.part.first && !shows[number].c.moved_x;
      drawn = scale + ' ' + moment.part.first;
      for (const panel of panels) {
        const {view} = panel, into = cross(view.up, view.right);
        const at = p => {
          const d = sub(p, centre);
          return px(view.x + 100 + scale * dot(d, view.right)) + ' ' + px(view.y + 75 - scale * dot(d, view.up));
        };
        if (!still) {
          const outlined = ({mesh, object}) => {
            let fill = '', lines = '';
            const where = mesh.corners.map(corner => at(placed(object, corner)));
            const front = mesh.units.map(n => dot(turned(object, n), into) < 1e-9);
            mesh.triangles.forEach((t, i) => {
              if (front[i]) fill += 'M' + t.map(v => where[v]).join('L') + 'Z';
            });
            for (const [a, b, one, two, crease] of mesh.edges)
              if (front[one] !== front[two] || (crease && front[one])) lines += 'M' + where[a] + 'L' + where[b];
            return {fill, lines};
          };
          const felt = moment.felt ? outlined(moment.felt) : {fill: '', lines: ''};
          panel.object.setAttribute('d', felt.fill);
          panel.crease.setAttribute('d', felt.lines);
          panel.seen.setAttribute('d', moment.seen ? outlined(moment.seen).lines : '');
        }
        const path = lines => lines.map(([a, b]) => 'M' + at(a) + 'L' + at(b)).join('');
        panel.virtual.setAttribute('d', path(moment.virtual));
        panel.ideal.setAttribute('d', path(moment.ideal));
        panel.contact.toggleAttribute('hidden', !moment.contact);
        panel.contact.style.display = moment.contact ? '' : 'none';
        let shaft = '';
        if (moment.contact) {
          const [x, y] = at(moment.contact).split(' ').map(Number);
          panel.contact.setAttribute('cx', x);
          panel.contact.setAttribute('cy', y);
          const dx = scale * metres_a_newton * dot(moment.force, view.right);
          const dy = -scale * metres_a_newton * dot(moment.force, view.up), length = Math.hypot(dx, dy);
          if (length > 2) {
            const [ux, uy, head] = [dx / length, dy / length, Math.min(8, 0.5 * length)];
            const barb = s => `L${px(x + dx - head * ux + s * 0.5 * head * uy)} ${px(y + dy - head * uy - s * 0.5 * head * ux)}`;
            const tip = `${px(x + dx)} ${px(y + dy)}`;
            shaft = `M${x} ${y}L${tip}M${tip}${barb(1)}M${tip}${barb(-1)}`;
          }
        }
        panel.force.setAttribute('d', shaft);
      }
      const step = most => {
        const power = 10 ** Math.floor(Math.log10(most));
        return [5, 2, 1].map(k => k * power).find(k => k <= most);
      };
      const length = step(150 / scale);
      bar.setAttribute('d', `M216 88V96M216 92H${px(216 + scale * length)}M${px(216 + scale * length)} 88V96`);
      words.textContent = `${+(1000 * length).toPrecision(3)} mm`;
      if (!metres_a_newton) return;
      const force = step(150 / (scale * metres_a_newton)), end = 216 + scale * metres_a_newton * force;
      arrow.setAttribute('d', `M216 42H${px(end)}m-8 -4l8 4l-8 4`);
      newtons.textContent = `${+force.toPrecision(3)} N`;
    };
  }

  // ---- force against time --------------------------------------------------------------------

  function plot(svg, show) {
    const kLeft = 44, kTop = 18, kBottom = 24;
    let width = 0, height = 0, cursor = null;
    const x = t => kLeft + (width - kLeft - 8) * (last > 0 ? t / last : 0);
    const most = strongest > 0 ? strongest : 1;
    const y = f => height - kBottom - (height - kTop - kBottom) * f / most;
    function redraw() {
      width = Math.max(svg.clientWidth, 160);
      height = Math.max(svg.clientHeight, 90);
      svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
      svg.replaceChildren();
      const c = show.c, n = show.time.length;
      // Contact, as bands.
      let bands = '';
      for (let i = 0; i < n; ++i) {
        if (!(c.contacts[i] > 0)) continue;
        let k = i;
        while (k + 1 < n && c.contacts[k + 1] > 0) ++k;
        bands += `M${px(x(show.time[i]))} ${kTop}V${height - kBottom}H${px(Math.max(x(show.time[k]), x(show.time[i]) + 0.7))}V${kTop}Z`;
        i = k;
      }
      node('path', {class: 'touch', d: bands}, svg);
      node('path', {class: 'axis', d: `M${kLeft} ${kTop}V${height - kBottom}H${width - 8}`, fill: 'none'}, svg);
      // Draw the least and the greatest force of every pixel, so that no peak is lost.
      let curve = '';
      for (let i = 0; i < n;) {
        const column = Math.floor(x(show.time[i]));
        let least = i, greatest = i;
        for (; i < n && Math.floor(x(show.time[i])) === column; ++i) {
          if (show.magnitude[i] < show.magnitude[least]) least = i;
          if (show.magnitude[i] > show.magnitude[greatest]) greatest = i;
        }
        for (const k of [...new Set([least, greatest])].sort((a, b) => a - b))
          curve += (curve ? 'L' : 'M') + px(x(show.time[k])) + ' ' + px(y(show.magnitude[k]));
      }
      node('path', {class: 'curve', d: curve}, svg);
      for (const part of show.parts.slice(1))
        node('path', {class: 'axis', d: `M${px(x(part.start))} ${kTop}V${height - kBottom}`}, svg);
      node('text', {x: 2, y: 12}, svg, 'force, N');
      node('text', {x: kLeft - 6, y: kTop + 10, 'text-anchor': 'end'}, svg, most.toFixed(most < 1 ? 2 : 1));
      node('text', {x: kLeft - 6, y: height - kBottom, 'text-anchor': 'end'}, svg, '0');
      const power = 10 ** Math.floor(Math.log10(Math.max(last, 1e-3))), count = last / power;
      const step = power * (count >= 5 ? 1 : count >= 2 ? 0.5 : 0.2);
      for (let t = 0; t <= last + 1e-9; t += step) {
        const end = x(t) > width - 30;
        node('path', {class: 'axis', d: `M${px(x(t))} ${height - kBottom}v4`}, svg);
        node('text', {x: px(end ? width - 2 : x(t)), y: height - 7, 'text-anchor': end ? 'end' : 'middle'}, svg,
             String(+t.toFixed(3)) + (t === 0 ? ' s' : ''));
      }
      cursor = node('path', {class: 'now'}, svg);
      mark();
    }
    function mark() {
      if (cursor) cursor.setAttribute('d', `M${px(x(now))} ${kTop - 4}V${height - kBottom}`);
    }
    const seek_there = event => {
      const box = svg.getBoundingClientRect();
      stop();
      seek(last * (event.clientX - box.left - kLeft * box.width / width) / ((width - kLeft - 8) * box.width / width));
    };
    svg.addEventListener('pointerdown', event => {
      svg.setPointerCapture(event.pointerId);
      seek_there(event);
    });
    svg.addEventListener('pointermove', event => {
      if (event.buttons) seek_there(event);
    });
    new ResizeObserver(redraw).observe(svg);
    redraw();
    return mark;
  }

  // ---- the page ------------------------------------------------------------------------------

  const element = (kind, parent, text, name) => {
    const out = document.createElement(kind);
    if (text !== undefined) out.textContent = text;
    if (name) out.className = name;
    parent.append(out);
    return out;
  };
  const vector = (v, digits, unit) => `(${v.map(a => a.toFixed(digits).replace(/^-(0\.?0*)$/, '$1')).join(', ')}) ${unit}`;
  let any_solid = true;
  shows.forEach((show, number) => {
    const section = element('section', $('shows'));
    section.setAttribute('aria-label', show.title);
    element('h2', section, show.title);
    for (const fact of show.facts) element('p', section, fact, 'soft');
    const picture = element('div', section, undefined, 'picture');
    const canvas = element('canvas', picture);
    canvas.tabIndex = 0;
    canvas.setAttribute('role', 'img');
    canvas.setAttribute('aria-label', `${show.title}: object, tool and force. Drag, or the arrow keys with Shift, to turn.`);
    show.paint = painter(canvas, stage);
    if (!show.paint) any_solid = false;
    const svg = node('svg', {role: 'img', 'aria-label': `${show.title}: object, tool and force from three sides`}, picture);
    show.project = three_views(svg, number);
    show.canvas = canvas;
    show.svg = svg;
    turn_by(canvas);
    const graph = node('svg', {class: 'plot', role: 'img', 'aria-label': `${show.title}: force against time`}, section);
    const list = element('dl', section, undefined, 'numbers');
    show.cells = {};
    for (const name of ['time', 'shown', 'force', 'tip', 'depth', 'contact', 'faults']) {
      const term = element('dt', list, name);
      show.cells[name] = element('dd', list);
      if (name === 'shown' && show.parts.length < 2) term.hidden = show.cells[name].hidden = true;
    }
    show.mark = plot(graph, show);
  });
  if (!any_solid) solid = false;

  // The tick at this time, or the last one before it.
  function index_at(show, t) {
    let a = 0, b = show.time.length - 1;
    while (a < b) {
      const middle = Math.ceil((a + b) / 2);
      if (show.time[middle] <= t + 1e-9) a = middle;
      else b = middle - 1;
    }
    return a;
  }
  function draw() {
    for (const show of shows) {
      const i = index_at(show, now), moment = tick(show, i), {cells} = show;
      show.canvas.hidden = !solid;
      show.svg.style.display = solid ? 'none' : '';
      if (solid) show.paint(moment);
      else show.project(moment);
      show.mark();
      const over = now > show.time[show.time.length - 1] + given.period ? ' (over)' : '';
      cells.time.textContent = `${moment.t.toFixed(3)} s, tick ${i - moment.part.first}${over}`;
      cells.shown.textContent = moment.part.label;
      cells.force.textContent = `${show.magnitude[i].toFixed(3)} N ${vector(moment.force, 3, 'N')}`;
      cells.tip.textContent = vector(times(1000, v3(show.c, 'tip', i)), 2, 'mm');
      cells.depth.textContent = `${(1000 * moment.depth).toFixed(3)} mm`;
      cells.contact.textContent = moment.contact
          ? `${moment.type}, ${moment.contacts} ${moment.contacts === 1 ? 'place' : 'places'}, ${vector(times(1000, moment.contact), 2, 'mm')}`
          : 'none';
      cells.faults.textContent = moment.faults.map(([, words]) => words).join(', ') || 'none';
    }
    $('time').value = now;
    $('time').setAttribute('aria-valuetext', `${now.toFixed(3)} seconds`);
    $('clock').textContent = `${now.toFixed(3)} of ${last.toFixed(3)} s`;
  }
  let asked = false;
  function redraw() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      draw();
    });
  }
  function seek(t) {
    now = Math.min(Math.max(t, 0), last);
    redraw();
  }
  let before = 0;
  function play(stamp) {
    if (!playing) return;
    if (before) seek(now + speed * (stamp - before) / 1000);
    before = stamp;
    if (now >= last) stop();
    else requestAnimationFrame(play);
  }
  function stop() {
    playing = false;
    $('play').textContent = 'Play';
  }
  function start() {
    if (now >= last) now = 0;
    playing = true;
    before = 0;
    $('play').textContent = 'Pause';
    requestAnimationFrame(play);
  }
  const toggle = () => playing ? stop() : start();
  function set_speed(value) {
    speed = value;
    $('speed').value = String(value);
  }
  function set_solid(wanted) {
    solid = wanted && any_solid;
    $('solid').setAttribute('aria-pressed', String(solid));
    $('views').setAttribute('aria-pressed', String(!solid));
    redraw();
  }
  function turn(yaw, pitch) {
    camera.yaw += yaw;
    camera.pitch = Math.min(Math.max(camera.pitch + pitch, -1.57), 1.57);
    redraw();
  }
  function zoom(by) {
    camera.zoom = Math.min(Math.max(camera.zoom * by, 0.2), 20);
    redraw();
  }
  // One finger or the mouse turns; two fingers or the wheel with Ctrl zoom.
  function turn_by(canvas) {
    const held = new Map();
    const apart = () => {
      const [a, b] = [...held.values()];
      return Math.hypot(a[0] - b[0], a[1] - b[1]);
    };
    canvas.addEventListener('pointerdown', event => {
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, [event.clientX, event.clientY]);
    });
    canvas.addEventListener('pointermove', event => {
      const old = held.get(event.pointerId);
      if (!old) return;
      const was = held.size === 2 ? apart() : 0;
      held.set(event.pointerId, [event.clientX, event.clientY]);
      if (held.size === 1) turn(-0.008 * (event.clientX - old[0]), 0.008 * (event.clientY - old[1]));
      else if (was > 0) zoom(apart() / was);
    });
    for (const kind of ['pointerup', 'pointercancel'])
      canvas.addEventListener(kind, event => held.delete(event.pointerId));
    canvas.addEventListener('wheel', event => {
      if (!event.ctrlKey) return;  // the page scrolls
      event.preventDefault();
      zoom(Math.exp(-0.002 * event.deltaY));
    }, {passive: false});
  }

  $('time').max = last;
  $('time').addEventListener('input', event => {
    stop();
    seek(Number(event.target.value));
  });
  $('play').addEventListener('click', toggle);
  $('speed').addEventListener('change', event => set_speed(Number(event.target.value)));
  $('solid').addEventListener('click', () => set_solid(true));
  $('views').addEventListener('click', () => set_solid(false));
  if (!any_solid) {
    $('solid').disabled = true;
    $('solid').title = 'This browser has no WebGL';
  }
  document.addEventListener('keydown', event => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === 'SELECT') return;
    const step = 10 * given.period, key = event.key;
    if (event.target.tagName === 'BUTTON' && (key === ' ' || key === 'Enter')) return;
    const turns = {ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]};
    const k = kSpeeds.indexOf(speed);
    if (event.shiftKey && turns[key]) turn(...turns[key]);
    else if (key === ' ' || key === 'k') toggle();
    else if (key === 'ArrowLeft') stop(), seek(now - step);
    else if (key === 'ArrowRight') stop(), seek(now + step);
    else if (key === ',') stop(), seek(now - given.period);
    else if (key === '.') stop(), seek(now + given.period);
    else if (key === 'Home') stop(), seek(0);
    else if (key === 'End') stop(), seek(last);
    else if (key === '<' || key === '[') set_speed(kSpeeds[Math.max(k - 1, 0)]);
    else if (key === '>' || key === ']') set_speed(kSpeeds[Math.min(k + 1, kSpeeds.length - 1)]);
    else if (key === '+' || key === '=') zoom(1.2);
    else if (key === '-') zoom(1 / 1.2);
    else if (key === 'v') set_solid(!solid);
    else if (key === '0') camera.yaw = -0.5, camera.pitch = 0.42, zoom(1 / camera.zoom);
    else return;
    event.preventDefault();
  });
  dark.addEventListener('change', redraw);
  window.addEventListener('resize', redraw);
  window.addEventListener('beforeprint', () => {
    printing = true;
    draw();
  });
  window.addEventListener('afterprint', () => {
    printing = false;
    redraw();
  });
  set_speed(1);
  set_solid(solid);
  // A trial begins with the approach: show its first contact.
  const touches = shows.map(s => s.time[s.c.contacts.findIndex(n => n > 0)]).filter(t => t !== undefined);
  now = touches.length ? Math.min(Math.min(...touches) + 0.2, last) : 0;
  draw();
  $('controls').hidden = false;
  $('loading').remove();
  // Gives access to the numbers from the browser console.
  window.trial = {shows, tick, seek: t => (now = Math.min(Math.max(t, 0), last), draw()), at: () => now};
})().catch(error => {
  document.getElementById('loading').textContent =
      'This page could not be drawn: ' + error.message + '. It needs a browser of 2023 or newer.';
});
