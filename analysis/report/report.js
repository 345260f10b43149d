// Tooltips, highlighting of one participant, saving of the page's figures, and copying and saving of
// its tables.
(() => {
  'use strict';
  const colours = JSON.parse(document.getElementById('saved-colours').textContent);
  const drawings = [...document.querySelectorAll('.drawing svg')];

  // What is saved: the figures as they came, before tooltips replace their titles.
  const saved = new Map();
  for (const tools of document.querySelectorAll('.tools[data-figure]')) {
    const drawing = tools.previousElementSibling.querySelector('.wide-screen svg');
    saved.set(tools.dataset.figure, drawing.cloneNode(true));
  }

  // A title would show as the browser's own tooltip as well, late and never on a touch screen.
  for (const drawing of drawings) {
    for (const title of drawing.querySelectorAll('g > title')) {
      title.parentNode.dataset.tip = title.textContent;
      title.remove();
    }
    const title = drawing.querySelector('title');
    drawing.setAttribute('aria-label', title.textContent);
    drawing.setAttribute('aria-describedby', drawing.querySelector('desc').id);
    drawing.removeAttribute('aria-labelledby');
    title.remove();
  }

  const marks = new Map(); // by participant
  for (const mark of document.querySelectorAll('.drawing [data-person]')) {
    const person = mark.dataset.person;
    if (!marks.has(person)) marks.set(person, []);
    marks.get(person).push(mark);
  }
  let picked = '';
  let chosen = '';
  function pick(person) {
    if (person === picked) return;
    for (const mark of marks.get(picked) || []) mark.classList.remove('picked');
    for (const mark of marks.get(person) || []) mark.classList.add('picked');
    document.documentElement.classList.toggle('picking', marks.has(person));
    picked = person;
  }

  const tip = document.createElement('div');
  tip.id = 'tip';
  tip.setAttribute('aria-hidden', 'true');
  tip.hidden = true;
  document.body.append(tip);

  // The mark at the pointer or, for thin lines, a few px beside it.
  function markAt(event) {
    for (const reach of [0, 3, 6]) {
      for (const [dx, dy] of [[0, -reach], [0, reach], [-reach, 0], [reach, 0]]) {
        const found = document.elementFromPoint(event.clientX + dx, event.clientY + dy);
        const mark = found && found.closest('.drawing [data-tip]');
        if (mark) return mark;
        if (reach === 0) break;
      }
    }
    return null;
  }

  // Text only: what comes from the data is never markup.
  function showTip(event) {
    const mark = event.type === 'pointerleave' ? null : markAt(event);
    pick((mark && mark.dataset.person) || chosen);
    tip.hidden = !mark;
    if (!mark) return;
    tip.textContent = mark.dataset.tip;
    const room = document.documentElement.clientWidth;
    tip.style.left = Math.max(8, Math.min(event.clientX + 14, room - tip.offsetWidth - 8)) + 'px';
    const above = event.clientY - tip.offsetHeight - 12;
    tip.style.top = (above > 4 ? above : event.clientY + 18) + 'px';
  }
  for (const drawing of drawings) {
    for (const event of ['pointermove', 'pointerdown', 'pointerleave']) {
      drawing.addEventListener(event, showTip);
    }
  }

  const chooser = document.getElementById('person');
  if (chooser && marks.size > 0) {
    chooser.closest('label').hidden = false;
    chooser.addEventListener('change', () => {
      chosen = chooser.value;
      pick(chosen);
    });
  }

  // With title, label and notes, in colours for paper.
  function fileText(id) {
    const source = saved.get(id).cloneNode(true);
    source.removeAttribute('style');
    const whole = source.dataset.whole;
    source.setAttribute('viewBox', whole);
    source.setAttribute('width', whole.split(' ')[2]);
    source.setAttribute('height', whole.split(' ')[3]);
    source.removeAttribute('data-whole');
    const text = new XMLSerializer().serializeToString(source);
    return text.replace(/var\(--([a-z]+)\)/g, (all, role) => colours[role] || all);
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
    const id = button.closest('.tools').dataset.figure;
    button.hidden = false;
    button.addEventListener('click', () => (button.dataset.save === 'svg' ? saveSvg : savePng)(id));
  }

  // A table as rows of texts. Numbers get the minus sign and the spaces that programs read; a name
  // that a spreadsheet would take for a formula gets an apostrophe, as in exports.
  function rowsOf(table) {
    return [...table.rows].map((row) => [...row.cells].map((cell) => {
      const text = cell.textContent.replace(/\u00a0/g, ' ').replace(/\u2212/g, '-');
      return /^[=+@\t\r-]/.test(text) && !/^[+-]?[\d.]/.test(text) ? "'" + text : text;
    }));
  }

  function tableOf(button) {
    return button.closest('.tools').previousElementSibling.querySelector('table');
  }

  function saveCsv(button) {
    const table = tableOf(button);
    const quoted = (text) => (/[",\n\r]/.test(text) ? '"' + text.replace(/"/g, '""') + '"' : text);
    const text = rowsOf(table).map((row) => row.map(quoted).join(',') + '\r\n').join('');
    const name = table.caption.textContent.toLowerCase().replace(/[^a-z0-9]+/g, '-');
    // The mark at the beginning tells spreadsheets that it is UTF-8.
    offer(new Blob(['\ufeff' + text], {type: 'text/csv;charset=utf-8'}),
        `${name.replace(/^-|-$/g, '').slice(0, 60) || 'table'}.csv`);
  }

  // With tabs, as spreadsheets and word processors paste it.
  function copied(button) {
    const text = rowsOf(tableOf(button)).map((row) => row.join('\t')).join('\n');
    const area = document.createElement('textarea');
    area.value = text;
    area.style.position = 'fixed';
    area.style.opacity = '0';
    document.body.append(area);
    area.select();
    const done = document.execCommand('copy');
    area.remove();
    button.focus();
    return done;
  }

  function copyTable(button) {
    const before = button.textContent;
    button.textContent = copied(button) ? 'Copied' : 'Cannot copy here';
    setTimeout(() => { button.textContent = before; }, 2000);
  }

  for (const button of document.querySelectorAll('button[data-table]')) {
    button.hidden = false;
    const run = button.dataset.table === 'csv' ? saveCsv : copyTable;
    button.addEventListener('click', () => run(button));
  }

  // On paper everything is open.
  let opened = [];
  window.addEventListener('beforeprint', () => {
    opened = [...document.querySelectorAll('details:not([open]):not(.long)')];
    for (const part of opened) part.open = true;
  });
  window.addEventListener('afterprint', () => {
    for (const part of opened) part.open = false;
  });
})();
