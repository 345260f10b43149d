// A trial on a page: draws its ticks at the time that the reader chooses.
(async () => {
  'use strict';
  const $ = id => document.getElementById(id);
  const given = JSON.parse($('ticks').textContent);
  const kSpeeds = [0.05, 0.1, 0.2, 0.5, 1, 2, 4];
  const {sub, times, size, frame, placed, node, painter, kLight, kDark} = palpate_drawing;
  const {scaled, v3} = palpate_trial;

  const {meshes, shows, tick} = await palpate_trial.trial_of(given);

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
    show.project = palpate_three_views(svg, stage, number, Boolean(show.c.moved_x));
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
    show.mark = palpate_force_plot(graph, show, {last, strongest, now: () => now, seek: t => {
      stop();
      seek(t);
    }});
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
