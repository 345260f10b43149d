// Force against time, as SVG.
const palpate_force_plot = (() => {
  'use strict';
  const {node, px} = palpate_drawing;

  // The force of `show` into `svg`; the function that marks the time. last: seconds of the axis; strongest: newtons;
  // now: gives the time; seek: takes what the reader chose.
  function force_plot(svg, show, {last, strongest, now, seek}) {
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
      if (cursor) cursor.setAttribute('d', `M${px(x(now()))} ${kTop - 4}V${height - kBottom}`);
    }
    const seek_there = event => {
      const box = svg.getBoundingClientRect();
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

  return force_plot;
})();
