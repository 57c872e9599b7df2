// Runs the program `wisp`, one command after the other: each in an instance of its own, as a process would be.
// Wisp() is emscripten's, which the build puts in front.
'use strict';
let module;       // the program
let files = {};   // in the folder of each run, by name

// Calls `take` with each line, whether it ends or is to be written over.
function lines(take) {
    let bytes = [];
    return (byte) => {
        if (byte !== 10 && byte !== 13) return void bytes.push(byte & 255);
        if (bytes.length) take(new TextDecoder().decode(new Uint8Array(bytes)));
        bytes = [];
    };
}

// Of the bar on standard error: `[####......] 34 %, frame 2: photons, 0:01`.
function progress(line) {
    const [, percent, stage] = line.match(/^\[[#.]*\] (\d+) %, frame \d+: ([^,]*),/) ?? [];
    if (percent) postMessage({ percent: +percent, stage });
    return percent || !line.trim();
}

async function run({ words, outputs }) {
    const said = [], complaints = [];
    const wisp = await Wisp({
        stdin: () => null,
        stdout: lines((line) => said.push(line)),
        stderr: lines((line) => progress(line) || complaints.push(line)),
        instantiateWasm(imports, instantiated) {
            WebAssembly.instantiate(module, imports).then(instantiated);
            return {};
        },
    });
    // Where the program looks for what memory is left: WebAssembly of 32 bits has 2 GiB at most.
    wisp.FS.writeFile('/proc/meminfo', 'MemAvailable: 1500000 kB\n');
    wisp.FS.mkdir('/scenes');
    wisp.FS.chdir('/scenes');
    for (const name in files) wisp.FS.writeFile(name, files[name]);
    const status = wisp.callMain(words);
    const made = {};
    for (const name of outputs) if (wisp.FS.analyzePath(name).exists) made[name] = wisp.FS.readFile(name);
    postMessage({ status, said: said.join('\n'), complaints: complaints.join('\n'), made });
}

onmessage = ({ data }) => {
    if (data.module) module = data.module;
    Object.assign(files, data.files);
    if (data.words) run(data).catch((error) => postMessage({ status: -1, said: '', complaints: `the program ends: ${error.message ?? error}`, made: {} }));
};
