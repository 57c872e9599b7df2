// Runs build/.../portable as WebAssembly, which imports nothing: node portable.mjs FILE f32|f64|fixed
import { readFileSync } from 'node:fs';

const [file, name] = process.argv.slice(2);
const { instance } = await WebAssembly.instantiate(readFileSync(file));
const { memory, _initialize, portable_fault, portable_line } = instance.exports;

const text = (address) => {
    const bytes = new Uint8Array(memory.buffer, address);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
};

_initialize();
const fault = portable_fault();
if (fault !== 0) {
    console.error(`this machine does not compute as wisp needs it: ${text(fault)}`);
    process.exit(2);
}
const arithmetic = ['f32', 'f64', 'fixed'].indexOf(name);
for (let i = 0, line; (line = portable_line(arithmetic, i)) !== 0; ++i) console.log(text(line));
