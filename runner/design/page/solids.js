// Small solids for the picture, put together into one list of corners and normals: lines, arrows, dots.

const {add, sub, times, cross, size, unit} = palpate_drawing;
const kSides = 6;

function beside(along) {
  const x = unit(cross(Math.abs(along[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], along));
  return [x, cross(along, x)];
}

/** Adds a rod, or a cone where its far end has no radius. */
export function put_rod(out, from, to, radius, far = radius) {
  const way = sub(to, from), along = unit(way);
  if (size(way) === 0) return;
  const [x, y] = beside(along);
  const at = k => add(times(Math.cos(2 * Math.PI * k / kSides), x), times(Math.sin(2 * Math.PI * k / kSides), y));
  for (let k = 0; k < kSides; ++k) {
    const [a, b] = [at(k), at(k + 1)];
    const p = (end, r, side) => [...add(end, times(r, side)), ...side];
    out.push(...p(from, radius, a), ...p(from, radius, b), ...p(to, far, b), ...p(from, radius, a), ...p(to, far, b), ...p(to, far, a));
    for (const [end, r] of [[from, radius], [to, far]])
      if (r > 0) out.push(...end, ...along, ...add(end, times(r, a)), ...along, ...add(end, times(r, b)), ...along);
  }
}

export function put_arrow(out, from, to, radius) {
  const way = sub(to, from), head = Math.min(6 * radius, 0.6 * size(way)), neck = sub(to, times(head / (size(way) || 1), way));
  put_rod(out, from, neck, radius);
  put_rod(out, neck, to, 2.6 * radius, 0);
}

export function put_dot(out, at, radius) {
  const ends = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]];
  for (let k = 0; k < 4; ++k)
    for (const pole of [[0, 0, 1], [0, 0, -1]])
      for (const end of [ends[k], ends[(k + 1) % 4], pole]) out.push(...add(at, times(radius, end)), ...end);
}

/** Waves of a sound that leave a body of radius `reach`, m, at its upper right. */
export function put_waves(out, reach) {
  const kSteps = 10, kSpread = 0.6;  // rad to either side
  for (const round of [1.15, 1.35]) {
    const at = k => times(round * reach, [Math.cos(0.25 * Math.PI + kSpread * (2 * k / kSteps - 1)), 0, Math.sin(0.25 * Math.PI + kSpread * (2 * k / kSteps - 1))]);
    for (let k = 0; k < kSteps; ++k) put_rod(out, at(k), at(k + 1), 0.02 * reach);
  }
}

/** Dots of a medium within a ball. */
function put_medium(out, reach) {
  const kEach = 2;  // on either side of the centre
  const steps = Array.from({length: 2 * kEach + 1}, (_, k) => reach * (k / kEach - 1));
  for (const x of steps)
    for (const y of steps)
      for (const z of steps)
        if (size([x, y, z]) <= 1.01 * reach) put_dot(out, [x, y, z], 0.035 * reach);
}

/** An arc about an axis through a centre, with an arrow at its end. */
function put_turn(out, centre, axis, round, radius, turns) {
  const [x, y] = beside(axis), kSteps = 20;
  const at = k => add(centre, times(round, add(times(Math.cos(turns * 1.6 * Math.PI * k / kSteps), x), times(Math.sin(turns * 1.6 * Math.PI * k / kSteps), y))));
  for (let k = 0; k + 1 < kSteps; ++k) put_rod(out, at(k), at(k + 1), radius);
  put_rod(out, at(kSteps - 1), add(at(kSteps - 1), times(6 * radius, unit(sub(at(kSteps), at(kSteps - 1))))), 2.6 * radius, 0);
}

/** How far a field reaches from the object's origin, m; those without a place are drawn as large as the object. */
export function extent_of(field) {
  if (field.kind === 'spring') return size(field.centre_m) + field.radius_m;
  if (field.kind === 'channel') return Math.max(size(field.centre_m), size(field.to_m)) + field.radius_m;
  return 0;
}

/** Adds a field: arrows along its force; dots where it resists every movement. `reach`: m, of what is drawn; what has no place of its own stands out of it. */
export function put_field(out, field, reach) {
  const thin = 0.03 * reach;
  if (field.kind === 'constant') {
    const way = times(1.9 * reach, unit(field.force_n));
    const [x, y] = beside(unit(field.force_n));
    for (const off of [[0, 0, 0], times(0.35 * reach, x), times(-0.35 * reach, x), times(0.35 * reach, y), times(-0.35 * reach, y)])
      put_arrow(out, add(off, times(-0.5, way)), add(off, times(0.5, way)), thin);
  } else if (field.kind === 'spring') {
    for (const end of [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]) {
      const near = Math.min(field.radius_m + 0.06 * reach, 0.5 * reach);
      put_arrow(out, add(field.centre_m, times(near + 0.45 * reach, end)), add(field.centre_m, times(near, end)), thin);
    }
    put_dot(out, field.centre_m, 2 * thin);
  } else if (field.kind === 'channel') {
    const way = sub(field.to_m, field.centre_m), [x, y] = beside(unit(way));
    for (const side of [x, y, times(-1, x), times(-1, y)]) {
      const off = times(Math.max(field.radius_m, 0.5 * thin), side);
      put_rod(out, add(field.centre_m, off), add(field.to_m, off), 0.6 * thin);
      for (const share of [0.25, 0.75]) {
        const near = add(add(field.centre_m, times(share, way)), times(1.3 * field.radius_m + 2 * thin, side));
        put_arrow(out, add(near, times(0.25 * reach, side)), near, thin);
      }
    }
  } else if (field.kind === 'curl' && field.turns !== 0) {
    put_turn(out, [0, 0, 0], unit(field.axis), 0.9 * reach, thin, field.turns);
    put_rod(out, times(-0.9 * reach, unit(field.axis)), times(0.9 * reach, unit(field.axis)), 0.6 * thin);
  } else if (field.kind === 'viscous' && field.resists) {
    put_medium(out, reach);
  } else if (field.kind === 'vibration') {
    const half = times(0.95 * reach, unit(field.axis));
    put_arrow(out, [0, 0, 0], half, thin);
    put_arrow(out, [0, 0, 0], times(-1, half), thin);
  }
}
