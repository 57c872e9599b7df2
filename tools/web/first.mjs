// Renders the picture that the page opens on, by the page's own worker, and prints it as the page's <img>.
// Usage: node tools/web/first.mjs, from the top folder, by tools/web/build.
import { readFileSync } from 'node:fs';
import { runInThisContext } from 'node:vm';
import { gunzipSync } from 'node:zlib';

// As `words` of page.js says for the page's own settings; the page takes it for no others.
const words = ['wake.aff', '--frames', '2', '--size', '320x240', '--spp', '4', '--photons', '100000'];
const unpacked = (name) => gunzipSync(Buffer.from(readFileSync(`build/web/${name}`, 'utf8'), 'base64'));
const files = Object.fromEntries(Object.entries(JSON.parse(unpacked('files'))).map(([name, text]) => [name, Buffer.from(text, 'base64')]));
globalThis.self = { location: { href: '' } }; // as a worker has it
const ran = new Promise((resolve) => { globalThis.postMessage = resolve; });
runInThisContext(readFileSync('build/web/wisp.js', 'utf8') + readFileSync('tools/web/worker.js', 'utf8'));
globalThis.onmessage({ data: { module: await WebAssembly.compile(unpacked('wasm')), files, outputs: ['first.png'],
                               words: ['render', ...words, '--arith', 'f32', '--digest', '--quiet', '-o', 'first.png'] } });
const { status, said, complaints, made } = await ran;
if (status !== 0) throw new Error(complaints || `wisp ends with ${status}`);
console.log(`<img id="picture" alt="Wake" data-words="${words.join(' ')}" data-digest="${said.slice(0, 64)}" ` +
            `src="data:image/png;base64,${Buffer.from(made['first.png']).toString('base64')}">`);
