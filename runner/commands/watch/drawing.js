// Drawing for the pages of palpate: vectors, surfaces, and a painter for WebGL.
const palpate_drawing = (() => {
  'use strict';
  const kCrease = Math.cos(Math.PI / 6);  // flatter edges are smooth

  // ---- vectors -------------------------------------------------------------------------------

  const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
  const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const times = (s, a) => [s * a[0], s * a[1], s * a[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) =>
      [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const size = a => Math.hypot(a[0], a[1], a[2]);
  const unit = a => times(1 / (size(a) || 1), a);
  // A pose is [x, y, z, qw, qx, qy, qz]; converts it to a matrix.
  function frame([x, y, z, w, i, j, k]) {
    return {
      x: [1 - 2 * (j * j + k * k), 2 * (i * j + k * w), 2 * (i * k - j * w)],
      y: [2 * (i * j - k * w), 1 - 2 * (i * i + k * k), 2 * (j * k + i * w)],
      z: [2 * (i * k + j * w), 2 * (j * k - i * w), 1 - 2 * (i * i + j * j)],
      o: [x, y, z],
    };
  }
  const turned = (f, p) => add(add(times(p[0], f.x), times(p[1], f.y)), times(p[2], f.z));
  const placed = (f, p) => add(turned(f, p), f.o);
  const joined = (a, b) =>
      ({x: turned(a, b.x), y: turned(a, b.y), z: turned(a, b.z), o: placed(a, b.o)});
  // A frame with z along d.
  function along(from, d, radius, length) {
    const z = unit(d);
    const x = unit(cross(Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], z));
    return {x: times(radius, x), y: times(radius, cross(z, x)), z: times(length, z), o: from};
  }

  // ---- surfaces ------------------------------------------------------------------------------

  // Triangles as three indices of corners, oriented outward.
  function surface_of(corners, triangles) {
    const normals = [], edges = new Map();
    for (const [index, t] of triangles.entries()) {
      normals.push(cross(sub(corners[t[1]], corners[t[0]]), sub(corners[t[2]], corners[t[0]])));
      for (let k = 0; k < 3; ++k) {
        const a = t[k], b = t[(k + 1) % 3], key = Math.min(a, b) * corners.length + Math.max(a, b);
        if (edges.has(key)) edges.get(key).push(index);
        else edges.set(key, [a, b, index]);
      }
    }
    const units = normals.map(unit);
    const around = corners.map(() => []);
    triangles.forEach((t, i) => t.forEach(v => around[v].push(i)));
    const vertices = [];
    triangles.forEach((t, i) => t.forEach(v => {
      let n = [0, 0, 0];
      for (const other of around[v])
        if (dot(units[other], units[i]) > kCrease) n = add(n, normals[other]);
      vertices.push(...corners[v], ...unit(n));
    }));
    return {
      corners, triangles, units, vertices: new Float32Array(vertices),
      edges: [...edges.values()].map(([a, b, one, two]) =>
          [a, b, one, two ?? one, two === undefined || dot(units[one], units[two]) < kCrease]),
    };
  }
  function rod(cone) {
    const kSides = 20, out = [];
    for (let i = 0; i < kSides; ++i) {
      const at = k => [Math.cos(2 * Math.PI * k / kSides), Math.sin(2 * Math.PI * k / kSides)];
      const [a, b] = [at(i), at(i + 1)], top = cone ? 0 : 1;
      const put = (p, z, s) => out.push(s * p[0], s * p[1], z, p[0], p[1], cone ? 1 : 0);
      put(a, 0, 1), put(b, 0, 1), put(b, 1, top), put(a, 0, 1), put(b, 1, top), put(a, 1, top);
      for (const z of cone ? [0] : [0, 1]) {
        const end = z ? 1 : -1, ring = z ? [a, b] : [b, a];
        out.push(0, 0, z, 0, 0, end);
        for (const p of ring) out.push(p[0], p[1], z, 0, 0, end);
      }
    }
    return new Float32Array(out);
  }
  function ball() {
    const kRings = 10, out = [];
    const at = (i, k) => {
      const a = Math.PI * i / kRings, b = Math.PI * k / kRings;
      return [Math.sin(a) * Math.cos(b), Math.sin(a) * Math.sin(b), Math.cos(a)];
    };
    for (let i = 0; i < kRings; ++i)
      for (let k = 0; k < 2 * kRings; ++k)
        for (const p of [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k), at(i + 1, k + 1), at(i, k + 1)])
          out.push(...p, ...p);
    return new Float32Array(out);
  }

  // ---- pictures ------------------------------------------------------------------------------

  const kLight = {page: '#ffffff', object: '#9db6d2', virtual: '#6b7680', ideal: '#0b62a8', force: '#b8480a'};
  const kDark = {page: '#171b1f', object: '#5b7695', virtual: '#a3adb7', ideal: '#6bb4f2', force: '#f2935c'};
  const rgb = text => [1, 3, 5].map(i => parseInt(text.slice(i, i + 2), 16) / 255);
  const kUnits = {rod: rod(false), cone: rod(true), ball: ball()};

  function axes_of(camera) {
    const [cy, sy, cp, sp] = [Math.cos(camera.yaw), Math.sin(camera.yaw), Math.cos(camera.pitch), Math.sin(camera.pitch)];
    const right = [cy, sy, 0], into = [-sy * cp, cy * cp, -sp];
    return {right, into, up: cross(right, into)};
  }

  // Null: the browser has no WebGL. stage: camera, size and centre of the view, length of a newton.
  function painter(canvas, stage) {
    const gl = canvas.getContext('webgl', {alpha: false, antialias: true, preserveDrawingBuffer: true});
    if (!gl) return null;
    const shader = (kind, text) => {
      const s = gl.createShader(kind);
      gl.shaderSource(s, text);
      gl.compileShader(s);
      return s;
    };
    const program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER,
        'attribute vec3 p, n; uniform mat4 model, view; varying vec3 normal;' +
        'void main() { normal = mat3(view) * (mat3(model) * n); gl_Position = view * model * vec4(p, 1.0); }'));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER,
        'precision mediump float; uniform vec4 colour; uniform vec3 scale; varying vec3 normal;' +
        'void main() { vec3 n = normalize(normal * scale);' +
        'float light = 0.55 + 0.45 * max(dot(n, vec3(-0.36, 0.62, -0.70)), 0.0);' +
        'gl_FragColor = vec4(colour.rgb * light, colour.a); }'));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
    gl.useProgram(program);
    const buffers = new Map();
    const place = name => gl.getUniformLocation(program, name);
    const at = {model: place('model'), view: place('view'), colour: place('colour'), scale: place('scale')};
    const p = gl.getAttribLocation(program, 'p'), n = gl.getAttribLocation(program, 'n');
    gl.enableVertexAttribArray(p);
    gl.enableVertexAttribArray(n);
    function draw(vertices, f, colour, opacity) {
      if (!buffers.has(vertices)) {
        buffers.set(vertices, gl.createBuffer());
        gl.bindBuffer(gl.ARRAY_BUFFER, buffers.get(vertices));
        gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
      }
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers.get(vertices));
      gl.vertexAttribPointer(p, 3, gl.FLOAT, false, 24, 0);
      gl.vertexAttribPointer(n, 3, gl.FLOAT, false, 24, 12);
      gl.uniformMatrix4fv(at.model, false, [...f.x, 0, ...f.y, 0, ...f.z, 0, ...f.o, 1]);
      gl.uniform4f(at.colour, ...rgb(colour), opacity);
      gl.drawArrays(gl.TRIANGLES, 0, vertices.length / 6);
    }
    return (moment) => {
      const {camera, radius, centre, metres_a_newton} = stage;
      const ratio = Math.min(window.devicePixelRatio || 1, 2);
      const w = Math.max(1, Math.round(canvas.clientWidth * ratio)), h = Math.max(1, Math.round(canvas.clientHeight * ratio));
      if (canvas.width !== w || canvas.height !== h) canvas.width = w, canvas.height = h;
      gl.viewport(0, 0, w, h);
      const colours = stage.colours();
      gl.clearColor(...rgb(colours.page), 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const {right, into, up} = axes_of(camera), s = camera.zoom / (1.7 * radius);
      const rows = [times(s * h / w, right), times(s, up), times(1 / (60 * radius), into)];
      const view = [0, 1, 2].flatMap(k => [rows[0][k], rows[1][k], rows[2][k], 0]);
      view.push(...rows.map(row => -dot(row, centre)), 1);
      gl.uniformMatrix4fv(at.view, false, view);
      gl.uniform3f(at.scale, ...rows.map(row => 1 / size(row)));
      gl.enable(gl.DEPTH_TEST);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      const line = ([a, b], r, colour, opacity) => {
        const d = sub(b, a), length = size(d);
        if (length > 0) draw(kUnits.rod, along(a, d, r, length), colour, opacity);
      };
      const dots = (at, r, colour, opacity) =>
          draw(kUnits.ball, {x: [r, 0, 0], y: [0, r, 0], z: [0, 0, r], o: at}, colour, opacity);
      const rest = opacity => {
        for (const one of moment.virtual) line(one, 0.016 * radius, colours.virtual, opacity);
        for (const one of moment.ideal) line(one, 0.024 * radius, colours.ideal, opacity);
        dots(moment.ideal[0][0], 0.034 * radius, colours.ideal, opacity);
        if (!moment.contact) return;
        dots(moment.contact, 0.05 * radius, colours.force, opacity);
        const by = times(metres_a_newton, moment.force), length = size(by);
        if (length < 1e-3 * radius) return;
        const head = Math.min(0.16 * radius, 0.6 * length), neck = add(moment.contact, times(1 - head / length, by));
        line([moment.contact, neck], 0.028 * radius, colours.force, opacity);
        draw(kUnits.cone, along(neck, by, 0.07 * radius, head), colours.force, opacity);
      };
      gl.depthFunc(gl.LEQUAL);
      for (const one of moment.objects ?? (moment.mesh ? [moment] : [])) {
        if (one.opacity) gl.enable(gl.CULL_FACE);  // what shines through has no back
        draw(one.mesh.vertices, one.object, colours[one.colour ?? 'object'], one.opacity ?? 1);
        gl.disable(gl.CULL_FACE);
      }
      // Parts inside or behind the object show through.
      gl.depthFunc(gl.GREATER);
      gl.depthMask(false);
      rest(0.3);
      gl.depthMask(true);
      gl.depthFunc(gl.LEQUAL);
      rest(1);
    };
  }

  // ---- SVG -----------------------------------------------------------------------------------

  const kSvg = 'http://www.w3.org/2000/svg';
  function node(kind, attributes, parent, text) {
    const out = document.createElementNS(kSvg, kind);
    for (const [name, value] of Object.entries(attributes)) out.setAttribute(name, value);
    if (text !== undefined) out.textContent = text;
    if (parent) parent.append(out);
    return out;
  }
  const px = v => v.toFixed(1);

  return {add, sub, times, dot, cross, size, unit, frame, turned, placed, joined, surface_of, axes_of, painter, node, px, kLight, kDark};
})();
