// Runs build/.../portable as WebAssembly, which imports nothing: node portable.mjs FILE f32|f64|fixed
// In Node, or, where CHROMIUM names a browser, in a page of it by build/web/node_modules/playwright-core.
import { readFileSync } from 'node:fs';

// All that it prints; whole as it is in a page, too.
async function lines([base64, name]) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const { instance } = await WebAssembly.instantiate(bytes);
    const { memory, _initialize, portable_fault, portable_line } = instance.exports;
    const text = (address) => {
        const rest = new Uint8Array(memory.buffer, address);
        return new TextDecoder().decode(rest.subarray(0, rest.indexOf(0)));
    };
    _initialize();
    const fault = portable_fault();
    if (fault !== 0) throw new Error(`this machine does not compute as wisp needs it: ${text(fault)}`);
    const all = [], arithmetic = ['f32', 'f64', 'fixed'].indexOf(name);
    for (let i = 0, line; (line = portable_line(arithmetic, i)) !== 0; ++i) all.push(text(line));
    return all;
}

const [file, name] = process.argv.slice(2);
const program = [readFileSync(file).toString('base64'), name];
if (process.env.CHROMIUM) {
    const { createRequire } = await import('node:module');
    const { resolve } = await import('node:path');
    const { execFileSync } = await import('node:child_process');
    const { chromium } = createRequire(resolve('build/web/index.html'))('playwright-core');
    const executablePath = execFileSync('which', [process.env.CHROMIUM]).toString().trim();
    const browser = await chromium.launch({ executablePath, args: ['--headless', '--no-sandbox', '--disable-gpu'] });
    const page = await browser.newPage();
    console.log((await page.evaluate(lines, program)).join('\n'));
    await browser.close();
} else {
    console.log((await lines(program)).join('\n'));
}
