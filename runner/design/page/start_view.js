// Where the file does not exist: protocols to begin with.

import {by_id, element} from './dom.js';

const kEmpty = `{
  "version": 2,
  "name": "NAME",
  "renderers": ["point"],
  "stimuli": [],
  "blocks": []
}
`;

/** A name that a protocol may have, from that of its file. */
export const name_of_file = file => file.replace(/\.json$/, '').replace(/[^A-Za-z0-9-]+/g, '-').replace(/^-+|-+$/g, '').slice(0, 64) || 'study';

/** The text of a template under a name of its own, so that its data are not taken for the template's. */
export function named(text, name) {
  return text.replace(/("name"\s*:\s*)"[^"]*"/, (_, before) => before + JSON.stringify(name));
}

/** Asks which to begin with; the text of it. */
export function choose_template({name, templates}) {
  const start = by_id('start');
  return new Promise(resolve => {
    const choose = text => {
      start.hidden = true;
      resolve(named(text, name_of_file(name)));
    };
    const card = one => element('button', {type: 'button', onclick: () => choose(one.text)},
        element('b', {text: one.title || one.name}), element('span', {text: one.description}));
    start.replaceChildren(element('h3', {text: `${name} does not exist yet. Begin with`}),
        element('p', {class: 'soft', text: 'Nothing is written before you save. Everything can be changed afterwards.'}),
        element('div', {class: 'cards'}, ...templates.map(card),
            card({title: 'Nothing', description: 'No stimuli and no blocks: add them.', text: kEmpty})));
    start.hidden = false;
    start.querySelector('button').focus();
  });
}
