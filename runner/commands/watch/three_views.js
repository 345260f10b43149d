// The trial from three sides, as SVG.
const palpate_three_views = (() => {
  'use strict';
  const {sub, dot, cross, turned, placed, node, px} = palpate_drawing;

  // Above: from above; below: from the front and from the right.
  const kViews = [
    {name: 'from above', x: 0, y: 0, right: [1, 0, 0], up: [0, 1, 0]},
    {name: 'from the front', x: 0, y: 150, right: [1, 0, 0], up: [0, 0, 1]},
    {name: 'from the right', x: 200, y: 150, right: [0, 1, 0], up: [0, 0, 1]},
  ];
  // The function that draws a moment into `svg`. name: of the picture on its page; moves: the object does.
  function three_views(svg, stage, name, moves) {
    const {camera, radius, centre, metres_a_newton} = stage;
    svg.setAttribute('viewBox', '0 0 400 300');
    const panels = kViews.map((view, i) => {
      const clip = `clip-${name}-${i}`;
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
      const still = drawn === scale + ' ' + moment.part.first && !moves;
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

  return three_views;
})();
