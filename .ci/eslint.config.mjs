// Rules for the scripts of palpate's pages. Usage: see .ci/run
const kBrowser = Object.fromEntries(
    ['palpate_drawing', 'palpate_trial', 'palpate_three_views', 'palpate_force_plot',  // scripts that pages load before
     'AbortController', 'addEventListener', 'alert', 'AudioContext', 'Blob', 'clearTimeout', 'console', 'CSS', 'customElements', 'CustomEvent', 'DecompressionStream', 'document',
     'Event', 'EventTarget', 'fetch', 'FileReader', 'getComputedStyle', 'globalThis', 'history', 'Image', 'location', 'matchMedia', 'navigator', 'performance',
     'requestAnimationFrame', 'cancelAnimationFrame', 'ResizeObserver', 'Response', 'setInterval', 'clearInterval', 'setTimeout', 'TextDecoder', 'TextEncoder', 'URL', 'WebSocket', 'window',
     'XMLSerializer', 'crypto', 'atob', 'btoa'].map(name => [name, 'readonly']));

export default [
  {
    files: ['**/*.js'],
    languageOptions: {ecmaVersion: 2024, sourceType: 'module', globals: kBrowser},
    linterOptions: {reportUnusedDisableDirectives: 'error'},
    rules: {
      'array-callback-return': 'error', 'constructor-super': 'error', 'eqeqeq': 'error', 'for-direction': 'error',
      'getter-return': 'error', 'no-async-promise-executor': 'error', 'no-case-declarations': 'error',
      'no-class-assign': 'error', 'no-compare-neg-zero': 'error', 'no-const-assign': 'error', 'no-constant-condition': ['error', {checkLoops: false}],
      'no-control-regex': 'error', 'no-debugger': 'error', 'no-dupe-args': 'error', 'no-dupe-class-members': 'error', 'no-dupe-else-if': 'error',
      'no-dupe-keys': 'error', 'no-duplicate-case': 'error', 'no-duplicate-imports': 'error', 'no-empty': 'error', 'no-eval': 'error', 'no-fallthrough': 'error',
      'no-func-assign': 'error', 'no-implied-eval': 'error', 'no-import-assign': 'error', 'no-new-func': 'error', 'no-redeclare': ['error', {builtinGlobals: false}],
      'no-self-assign': 'error', 'no-self-compare': 'error', 'no-shadow-restricted-names': 'error', 'no-this-before-super': 'error',
      'no-undef': 'error', 'no-unreachable': 'error', 'no-unsafe-finally': 'error', 'no-unsafe-optional-chaining': 'error', 'no-unused-vars': ['error', {vars: 'local'}],
      'no-useless-escape': 'error', 'no-var': 'error', 'prefer-const': 'error', 'require-yield': 'error', 'use-isnan': 'error', 'valid-typeof': 'error',
    },
  },
  {files: ['analysis/**/*.js', 'runner/commands/**/*.js'], languageOptions: {sourceType: 'script'}},
  {files: ['**/*.js'], rules: {'max-lines': ['error', 400]}},
  {files: ['runner/design/**/*.js'], rules: {'no-unused-vars': 'error'}},
];
