// Renders the picture that the page opens on, by the page's own program, and prints it as the page's <img>.
// Usage: node tools/web/first.mjs, from the top folder, by tools/web/build.
import { createRequire } from 'node:module';
import { readdirSync, readFileSync } from 'node:fs';
import { resolve } from 'node:path';

// As `words` of page.js says for the page's own settings; the page takes it for no others.
const words = ['wake.aff', '--frames', '2', '--size', '320x240', '--spp', '4', '--photons', '100000'];
let said = '';
globalThis.self = { location: { href: '' } }; // as a worker has it, for which the program is linked
const wisp = await createRequire(resolve('build/web/index.html'))('./wisp.js')({
    wasmBinary: readFileSync('build/web/wisp.wasm'),
    print: (line) => { said += line; },
});
wisp.FS.writeFile('/proc/meminfo', 'MemAvailable: 1500000 kB\n');
for (const name of readdirSync('fixtures').filter((name) => /^wake|checker/.test(name))) wisp.FS.writeFile(name, readFileSync(`fixtures/${name}`));
const status = wisp.callMain(['render', ...words, '--arith', 'f32', '--digest', '--quiet', '-o', 'first.png']);
if (status !== 0) throw new Error(`wisp ends with ${status}`);
const png = Buffer.from(wisp.FS.readFile('first.png')).toString('base64');
console.log(`<img id="picture" alt="Wake" data-words="${words.join(' ')}" data-digest="${said.slice(0, 64)}" src="data:image/png;base64,${png}">`);
