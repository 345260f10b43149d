// The watchers' page of palpate serve: draws the current scene, stylus and force. The token is the address's
// fragment, which browsers do not send to servers.
(() => {
  'use strict';
  const {sub, times, size, surface_of, painter, kLight, kDark} = palpate_drawing;
  const $ = id => document.getElementById(id);
  const kFields = ['tip', 'tail', 'force', 'contact', 'depth', 'object'];
  const kSeconds = 10, kMostEvents = 200;
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const camera = {yaw: -0.5, pitch: 0.42, zoom: 1};
  const stage = {camera, radius: 0.08, centre: [0, 0, 0], metres_a_newton: 0.02, colours: () => dark.matches ? kDark : kLight};
  const still = {x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1], o: [0, 0, 0]};
  const paint = painter($('scene'), stage);
  $('scene').hidden = !paint;
  $('flat').hidden = !!paint;
  let objects = [], newest = null, dropped = 0, first_ns = 0;
  const forces = [];  // [s, N] of the last seconds

  // ---- the connection --------------------------------------------------------------------------

  const token = location.hash.slice(1);
  history.replaceState(null, '', location.pathname);
  let socket = null, number = 0;
  const waiting = new Map();
  const ask = (type, values = {}) => new Promise((resolve, reject) => {
    waiting.set(++number, {resolve, reject});
    socket.send(JSON.stringify({id: number, type, ...values}));
  });
  function say(words, kind) {
    $('state').textContent = words;
    $('state').className = kind;
  }
  async function begin() {
    const said = await ask('hello', {token, version: 1, role: 'watch'});
    first_ns = said.t_ns;
    $('off').hidden = false;
    say('forces off', '');
    tell_record(said.record);
    await ask('subscribe', {rate_hz: 60, fields: kFields});
    await picture();
  }
  async function picture() {
    const said = await ask('picture');
    objects = said.objects.map(one => ({mesh: surface_of(one.corners, one.triangles), object: still}));
    const corners = said.objects.flatMap(one => one.corners);
    if (!corners.length) return;
    const ends = (pick, k) => corners.reduce((v, p) => pick(v, p[k]), corners[0][k]);
    stage.centre = [0, 1, 2].map(k => (ends(Math.min, k) + ends(Math.max, k)) / 2);
    stage.radius = corners.reduce((r, p) => Math.max(r, size(sub(p, stage.centre))), 1e-3);
    stage.metres_a_newton = 0.35 * stage.radius;
  }
  function tell_record(record) {
    if (!record) return;
    const due = record.next ? `, next: trial ${record.next.trial}` : ', all done';
    $('record').textContent = `${record.protocol}, participant ${record.participant}, session ${record.session}: ` +
        `${record.done} of ${record.trials} trials${due}`;
  }
  function take(message) {
    if (message.stream) return take_rows(message);
    if (message.event) return take_event(message);
    const asked = waiting.get(message.re);
    waiting.delete(message.re);
    if (!asked) return;
    if (message.ok) asked.resolve(message);
    else asked.reject(new Error(message.error.message));
  }
  function take_rows({stream, dropped: left_out}) {
    dropped += left_out;
    for (const row of stream) {
      newest = {
        t: (row[0] - first_ns) * 1e-9, tip: row.slice(2, 5), tail: row.slice(5, 8), force: row.slice(8, 11),
        contact: row[15] >= 0 ? row.slice(11, 14) : null, depth: row[14],
      };
      forces.push([newest.t, size(newest.force)]);
    }
    while (forces.length && forces[0][0] < newest.t - kSeconds) forces.shift();
  }
  const kOn = new Set(['started', 'first_contact']);
  const kOff = new Set(['stopped', 'answered', 'stored', 'cut_off', 'over', 'rest', 'cleared']);
  const kAlarm = new Set(['forces_off', 'emergency', 'client_silent', 'controller_gone', 'fault']);
  function take_event(event) {
    const {event: name, t_ns, ...more} = event;
    if (kOn.has(name)) say('forces on', 'on');
    if (kOff.has(name)) say('forces off', '');
    if (name === 'cleared') $('allow').hidden = true;
    if (kAlarm.has(name)) say(more.reason ? `forces off: ${more.reason}` : 'forces off', 'off');
    if (name === 'started') forces.length = 0;
    if (name === 'loaded' || name === 'set' || name === 'started') picture().catch(fail);
    if (name === 'stored') {
      const next = more.next ? `next: trial ${more.next.trial}` : 'all done';
      $('record').textContent = $('record').textContent.replace(/: .*/, `: trial ${more.trial} on record, ${next}`);
      delete more.next;
    }
    const item = document.createElement('li');
    for (const text of [((t_ns - first_ns) * 1e-9).toFixed(3), name.replaceAll('_', ' ') + words_of(more)]) {
      const part = document.createElement('span');
      part.textContent = text;
      item.append(part);
    }
    $('events').prepend(item);
    while ($('events').children.length > kMostEvents) $('events').lastChild.remove();
  }
  const words_of = more => {
    const shown = Object.entries(more).filter(([, value]) => value !== null && value !== '' && typeof value !== 'object');
    const text = shown.slice(0, 6).map(([key, value]) => `${key} ${typeof value === 'number' ? +value.toPrecision(5) : value}`);
    return text.length ? `: ${text.join(', ')}` : '';
  };
  const fail = error => say(error.message, 'off');

  if (!token) {
    say('no token: open the address that palpate serve prints as "page"', 'off');
  } else {
    socket = new WebSocket(`ws://${location.host}`, 'palpate.1');
    socket.onopen = () => begin().catch(fail);
    socket.onmessage = event => take(JSON.parse(event.data));
    socket.onclose = () => {
      $('off').hidden = $('allow').hidden = true;
      if ($('state').className !== 'off') say('the server has gone', 'off');
    };
  }
  const off = () => socket?.readyState === WebSocket.OPEN &&
      ask('emergency').then(() => $('allow').hidden = false).catch(fail);
  $('off').addEventListener('click', off);
  $('allow').addEventListener('click', () => ask('clear').catch(fail));

  // ---- the pictures ----------------------------------------------------------------------------

  const vector = (v, digits, unit) => `(${v.map(a => a.toFixed(digits).replace(/^-(0\.?0*)$/, '$1')).join(', ')}) ${unit}`;
  const kAside = {tip: [0, 0, 1e3], tail: [0, 0, 1e3 + 1]};
  function draw() {
    const shown = newest ?? {...kAside, force: [0, 0, 0], contact: null};
    if (paint) {
      paint({objects, mesh: null, virtual: [], ideal: [[shown.tip, shown.tail]], contact: shown.contact, force: shown.force});
    }
    plot();
    if (newest) {
      $('force').textContent = `${size(newest.force).toFixed(3)} N ${vector(newest.force, 3, 'N')}`;
      $('tip').textContent = vector(times(1000, newest.tip), 2, 'mm');
      $('depth').textContent = `${(1000 * newest.depth).toFixed(3)} mm`;
    }
    $('dropped').textContent = `${dropped} ticks`;
    requestAnimationFrame(draw);
  }
  function plot() {
    const canvas = $('plot'), ratio = Math.min(window.devicePixelRatio || 1, 2);
    const w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== w || canvas.height !== h) canvas.width = w, canvas.height = h;
    const c = canvas.getContext('2d'), style = getComputedStyle(document.documentElement);
    const last = newest ? newest.t : 0, most = forces.reduce((m, [, f]) => Math.max(m, f), 0.5);
    const left = 34 * ratio, foot = 18 * ratio;
    const x = t => left + (w - left) * (1 + (t - last) / kSeconds), y = f => (h - foot) * (1 - 0.92 * f / most);
    c.clearRect(0, 0, w, h);
    c.font = `${12 * ratio}px system-ui, sans-serif`;
    c.fillStyle = style.getPropertyValue('--soft');
    c.strokeStyle = style.getPropertyValue('--rule');
    c.lineWidth = ratio;
    for (const f of [0, most / 2, most]) {
      c.beginPath();
      c.moveTo(left, y(f));
      c.lineTo(w, y(f));
      c.stroke();
      c.textAlign = 'right';
      c.fillText(f.toFixed(most < 2 ? 2 : 1), left - 5 * ratio, y(f) + 4 * ratio);
    }
    c.fillText('now', w - 2 * ratio, h - 4 * ratio);
    c.textAlign = 'left';
    c.fillText(`${-kSeconds} s`, left, h - 4 * ratio);
    c.strokeStyle = style.getPropertyValue('--force');
    c.lineWidth = 1.5 * ratio;
    c.lineJoin = 'round';
    c.beginPath();
    forces.forEach(([t, f], i) => i ? c.lineTo(x(t), y(f)) : c.moveTo(x(t), y(f)));
    c.stroke();
  }
  function turn(yaw, pitch) {
    camera.yaw += yaw;
    camera.pitch = Math.min(Math.max(camera.pitch + pitch, -1.57), 1.57);
  }
  const zoom = by => camera.zoom = Math.min(Math.max(camera.zoom * by, 0.2), 20);
  $('scene').addEventListener('pointerdown', event => $('scene').setPointerCapture(event.pointerId));
  $('scene').addEventListener('pointermove', event => {
    if (event.buttons) turn(-0.008 * event.movementX, 0.008 * event.movementY);
  });
  $('scene').addEventListener('wheel', event => {
    event.preventDefault();
    zoom(Math.exp(-0.002 * event.deltaY));
  }, {passive: false});
  document.addEventListener('keydown', event => {
    const turns = {ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]};
    if (event.key === 'Escape') off();
    else if (document.activeElement !== $('scene')) return;
    else if (turns[event.key]) turn(...turns[event.key]);
    else if (event.key === '+' || event.key === '=') zoom(1.2);
    else if (event.key === '-') zoom(1 / 1.2);
    else return;
    event.preventDefault();
  });
  draw();
  // Gives access to the numbers from the browser console.
  window.live = {stage, newest: () => newest, objects: () => objects, forces};
})();
