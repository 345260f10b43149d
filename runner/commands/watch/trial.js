// The ticks of a trial: decoded, and what one of them shows.
const palpate_trial = (() => {
  'use strict';
  const {add, sub, times, dot, cross, unit, frame, placed, joined, surface_of} = palpate_drawing;

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

  async function mesh_of(given) {
    const c = await columns(given.data, given.columns);
    const triangles = [];
    for (let i = 0; i < c.corner.length; i += 3) triangles.push([c.corner[i], c.corner[i + 1], c.corner[i + 2]]);
    return surface_of(Array.from(c.x, (x, i) => [x, c.y[i], c.z[i]]), triangles);
  }

  function scaled(f, by) {
    return {x: times(by, f.x), y: times(by, f.y), z: times(by, f.z), o: f.o};
  }

  const v3 = (c, name, i) => [c[name + '_x'][i], c[name + '_y'][i], c[name + '_z'][i]];

  // Meshes and shows of a page, and tick(show, i): what is drawn of it.
  async function trial_of(given) {
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
    return {meshes, shows, tick};
  }

  return {trial_of, scaled, v3};
})();
