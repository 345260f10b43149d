// Draws the report's figures with Vega where it is there, and saves them.
(() => {
  'use strict';
  const content = JSON.parse(document.getElementById('report-data').textContent);
  const views = new Map();
  const tip = document.createElement('div');
  tip.id = 'tip';
  tip.setAttribute('aria-hidden', 'true');
  tip.hidden = true;
  document.body.append(tip);

  // Text only: what comes from the data is never markup.
  function showTip(handler, event, item, text) {
    tip.hidden = text === null || text === undefined || text === '';
    if (tip.hidden) return;
    tip.textContent = String(text);
    const room = document.documentElement.clientWidth;
    tip.style.left = Math.max(8, Math.min(event.clientX + 14, room - tip.offsetWidth - 8)) + 'px';
    const above = event.clientY - tip.offsetHeight - 12;
    tip.style.top = (above > 4 ? above : event.clientY + 18) + 'px';
  }

  function roomIn(box) {
    return Math.max(280, Math.floor(box.clientWidth));
  }

  // The second run takes up the size that the first found.
  function fit(view, room) {
    view.signal('room', room).resize().run();
    view.run();
  }

  function draw(id, spec) {
    const box = document.querySelector(`#${id} .drawing`);
    if (!box) return;
    const target = document.createElement('div');
    target.className = 'vega';
    const fixed = box.querySelector('.fixed');
    fixed.hidden = true;
    box.append(target);
    try {
      const view = new palpateVega.View(palpateVega.parse(spec, null, {ast: true}), {
        expr: palpateVega.expressionInterpreter,
        renderer: 'svg',
        container: target,
        hover: true,
        logLevel: 1,
      });
      view.tooltip(showTip);
      fit(view, roomIn(box));
      views.set(id, {view, box});
    } catch (error) {
      target.remove();
      fixed.hidden = false;
      throw error;
    }
  }

  if (window.palpateVega) {
    for (const [id, spec] of Object.entries(content.figures)) draw(id, spec);
    let waiting = 0;
    window.addEventListener('resize', () => {
      cancelAnimationFrame(waiting);
      waiting = requestAnimationFrame(() => {
        for (const {view, box} of views.values()) fit(view, roomIn(box));
      });
    });
    const chooser = document.getElementById('person');
    if (chooser && views.has('figure15')) {
      chooser.closest('label').hidden = false;
      chooser.addEventListener('change', () => {
        views.get('figure15').view.signal('chosen', chooser.value).run();
      });
    }
  }

  // What is saved is the figure with title, label and notes, in colours for paper.
  function fileText(id) {
    const source = document.querySelector(`#${id} .fixed svg`).cloneNode(true);
    source.removeAttribute('style');
    const whole = source.dataset.whole;
    source.setAttribute('viewBox', whole);
    source.setAttribute('width', whole.split(' ')[2]);
    source.setAttribute('height', whole.split(' ')[3]);
    source.removeAttribute('data-whole');
    const text = new XMLSerializer().serializeToString(source);
    return text.replace(/var\(--([a-z]+)\)/g, (all, role) => content.palette[role] || all);
  }

  function offer(blob, name) {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = name;
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  function saveSvg(id) {
    offer(new Blob([fileText(id)], {type: 'image/svg+xml'}), `${id}.svg`);
  }

  function savePng(id) {
    const text = fileText(id);
    const image = new Image();
    const [width, height] = text.match(/viewBox="0 0 (\d+) (\d+)"/).slice(1).map(Number);
    image.onload = () => {
      const canvas = document.createElement('canvas');
      canvas.width = 2 * width;
      canvas.height = 2 * height;
      canvas.getContext('2d').drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob((blob) => offer(blob, `${id}.png`), 'image/png');
    };
    image.src = 'data:image/svg+xml;charset=utf-8,' + encodeURIComponent(text);
  }

  for (const button of document.querySelectorAll('button[data-save]')) {
    const id = button.closest('section').id;
    button.hidden = false;
    button.addEventListener('click', () => (button.dataset.save === 'svg' ? saveSvg : savePng)(id));
  }

  // On paper everything is open.
  let opened = [];
  window.addEventListener('beforeprint', () => {
    opened = [...document.querySelectorAll('details:not([open]):not(.long)')];
    for (const part of opened) part.open = true;
    for (const {view} of views.values()) fit(view, 900);
  });
  window.addEventListener('afterprint', () => {
    for (const part of opened) part.open = false;
    for (const {view, box} of views.values()) fit(view, roomIn(box));
  });
  document.documentElement.dataset.ready = String(views.size);
})();
