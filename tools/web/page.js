// The page: it edits scenes and options, has the worker run wisp on them, and shows what wisp writes.
'use strict';
const at = (id) => document.getElementById(id);
const goldens = new Map(at('goldens').textContent.trim().split('\n').map((line) => [line.slice(66), line.slice(0, 64)]));

// ---- What there is to choose
// `golden` has scene and options of a line of goldens.txt.
const presets = {
    wake: { name: 'Wake', sentence: 'Smoke curls around two balls that move over a mirroring floor.', options: ['--frames', '2'],
            golden: 'wake.aff --frames 2 --size 64x48 --spp 1 --photons 20000' },
    plume: { name: 'Plume', sentence: 'A dense plume rises in warm light from the side.', options: [],
             golden: 'demo.aff --density-step 0.5 --size 40x40 --spp 1 --photons 20000' },
    tinted: { name: 'Tinted smoke', sentence: 'The plume scatters forward, and red more than blue. One of its two lights is inside.', options: [],
              golden: 'small.aff --irradiance adaptive --density-step 0.5 --size 24x16 --photons 10000' },
    glow: { name: 'Glowing ball', sentence: 'Two smokes overlap, and one of them glows.', options: [], golden: 'glow.aff' },
    grid: { name: 'Density grid', sentence: 'A turned grid is lit from within. A box of even smoke glows beside it.', options: [],
            golden: 'grid.aff --smoke map --deposit exact --irradiance none' },
    forward: { name: 'Light from behind', sentence: 'A grid scatters strongly forward and is lit from behind.', options: [], golden: 'forward.aff' },
    surfaces: { name: 'Surfaces', sentence: 'Glass, a mirror, textures and shadows, without smoke.', options: ['--frames', '3'],
                golden: 'surfaces.aff --frames 3 --spp 1' },
};
const tabs = ['picture', 'arithmetics', 'density', 'depth', 'light-depth', 'photons', 'paths', 'nodes', 'tree', 'visits', 'proofs', 'wrong'];
const range = (from, to, step) => Array.from({ length: Math.round((to - from) / step) + 1 }, (_, i) => +(from + i * step).toFixed(4));
const factors = [0.125, 0.25, 0.5, 0.7, 1, 1.4, 2, 4, 8];
const times = (factor) => `\u00d7 ${factor}`;
// A slider chooses one of the values; the scene's own is `own`, of the scene's text.
const sliders = {
    photons: { label: 'Photons', values: [0, 1000, 2000, 5000, 10000, 20000, 40000, 100000, 200000, 500000, 1000000], smoke: true,
               own: () => golden() ? +(optionOf(goldenWords(), '--photons') ?? scene.text.match(/^render photons (\S+)/m)?.[1] ?? 1000000) : 100000,
               say: (n) => n.toLocaleString('en') },
    step: { label: 'March step', values: [0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 3, 4], smoke: true, own: () => 0.5, say: (h) => `${h} smoothing lengths` },
    g: { label: 'Scattering direction g', values: range(-0.9, 0.9, 0.1), smoke: true, own: () => +(scene.text.match(/\bphase\s+(\S+)/)?.[1] ?? 0),
         say: (g) => `${g}, ${g < 0 ? 'backward' : g > 0 ? 'forward' : 'even'}` },
    albedo: { label: 'Albedo', values: range(0, 1, 0.05), smoke: true,
              own: () => mean((scene.text.match(/\balbedo\s+(\S+)\s+(\S+)\s+(\S+)/)?.slice(1) ?? [0.9]).map(Number)), say: (a) => +a.toFixed(2) },
    extinction: { label: 'Extinction', values: factors, smoke: true, own: () => 1, say: times },
    light: { label: 'Light', values: factors, own: () => 1, say: times },
    // Of some stages:
    slice: { label: 'Plane, near to far', values: range(0, 1, 0.05), own: () => 0.5, say: String, stages: ['density', 'light-depth', 'nodes'] },
    lamp: { label: 'Light', values: range(0, 7, 1), own: () => 0, say: String, stages: ['light-depth', 'proofs'] },
    row: { label: 'Row, top to bottom', values: range(0, 1, 0.05), own: () => 0.5, say: String, stages: ['tree'] },
};
const mean = (numbers) => numbers.reduce((a, b) => a + b, 0) / numbers.length;

// ---- What is chosen; the link holds it. What is not in it is as the scene has it.
let state = {};
let scene;       // { name, sentence, file, text, options, golden }
const scenes = {}; // by the key that is state.scene
const arith = () => state.arith ?? 'f32';
const tab = () => state.tab ?? 'picture';
const golden = () => state.size === 'golden';
const goldenWords = () => scene.golden.split(' ');
const chosen = (id) => +(state[id] ?? sliders[id].own());
const optionOf = (words, option) => words.includes(option) ? words[words.indexOf(option) + 1] : undefined;
const hasSmoke = () => /^\s*smoke\b/m.test(scene.text);

function read() {
    state = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
    if (!scenes[state.scene]) state.scene = 'wake';
    if (!tabs.includes(tab())) delete state.tab;
}
function write() {
    history.replaceState(null, '', '#' + new URLSearchParams(state));
}

// ---- Scenes as text
// The text with what the sliders say of it. Lights, and the words in the braces of smoke, are as the manual has them.
function edited() {
    let text = scene.text;
    const smoke = (change) => { text = text.replace(/^\s*smoke\b[^{]*\{[^}]*\}/gm, change); };
    const word = (name, count, values) => smoke((block) =>
        block.replace(new RegExp(`\\b${name}(\\s+[-+.\\de]+){${count}}`, 'g'), '').replace(/\}$/, `  ${name} ${values}\n}`));
    if (state.g !== undefined) word('phase', 1, chosen('g'));
    if (state.albedo !== undefined) word('albedo', 3, Array(3).fill(chosen('albedo')).join(' '));
    if (state.extinction !== undefined)
        smoke((block) => /\bextinction\b/.test(block) ? block.replace(/\bextinction\s+(\S+)/g, (_, c) => `extinction ${+(c * chosen('extinction')).toPrecision(6)}`)
                                                      : block.replace(/\}$/, `  extinction ${chosen('extinction')}\n}`));
    if (state.light !== undefined)
        text = text.replace(/^(\s*(?:l|lp|ls|ld|la\s+\S+))((?:[ \t]+[-+.\de]+)+)/gm, (_, kind, numbers) => {
            const all = numbers.trim().split(/\s+/);
            return `${kind} ${all.map((x, i) => i > 2 && i >= all.length - 3 ? +(x * chosen('light')).toPrecision(6) : x).join(' ')}`;
        });
    return text;
}
// Width and height of the picture.
function size() {
    const own = scene.text.match(/\bresolution\s+(\d+)\s+(\d+)/)?.slice(1).map(Number) ?? [400, 300];
    if (golden()) return optionOf(goldenWords(), '--size')?.split('x').map(Number) ?? own;
    const width = +(state.size ?? 320);
    return [width, Math.round(width * own[1] / own[0])];
}
// Scene and options as words of the command line. A coarse picture has half of the rows, fewer photons and longer steps.
function words(coarse) {
    const file = edited() === scene.text ? scene.file : `edited-${scene.file}`;
    const set = (list, option, value) => {
        if (list.includes(option)) list[list.indexOf(option) + 1] = value;
        else list.push(option, value);
    };
    const list = golden() ? [file, ...goldenWords().slice(1)] : [file, ...scene.options];
    if (!golden()) {
        set(list, '--size', size().map((side) => Math.max(1, Math.round(side / (coarse ? 2 : 1)))).join('x'));
        set(list, '--spp', coarse ? '1' : '4');
        if (hasSmoke()) set(list, '--photons', String(coarse ? Math.min(5000, chosen('photons')) : chosen('photons')));
        if (coarse && hasSmoke()) list.push('--density-step', '2', '--light-step', '2', '--step', '2');
    } else if (state.photons !== undefined) set(list, '--photons', String(chosen('photons')));
    if (hasSmoke() && state.step !== undefined) set(list, '--step', String(chosen('step')));
    return list;
}

// ---- Running wisp: one command at a time
const source = URL.createObjectURL(new Blob([at('worker').textContent], { type: 'text/javascript' }));
const stopped = new Error('stopped');
const dropped = {}; // files
let module, fixtures, worker, waiting;
const results = new Map(); // of commands, the last ones

const unpacked = (bytes, type) => new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip')), { headers: { 'Content-Type': type } });
function bytesOf(base64) {
    const text = atob(base64.trim()), bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    return bytes;
}

function start() {
    worker?.terminate();
    worker = new Worker(source);
    worker.onmessage = ({ data }) => {
        if (data.stage) return progress(data.stage, data.percent);
        const { resolve } = waiting;
        waiting = undefined;
        resolve(data);
    };
    worker.onerror = (event) => {
        event.preventDefault();
        const { resolve } = waiting ?? { resolve() {} };
        waiting = undefined;
        start();
        resolve({ status: -1, said: '', complaints: `the program ends: ${event.message}`, made: {} });
    };
    if (module) worker.postMessage({ module, files: { ...fixtures, ...dropped } });
}
function stop() {
    if (!waiting) return;
    waiting.reject(stopped);
    waiting = undefined;
    start();
}
// What the command has said and made. Throws its complaint where its status is above `allowed`.
async function run(list, outputs = [], files = {}, allowed = 0) {
    const text = edited();
    const key = JSON.stringify([list, text]);
    let result = results.get(key);
    if (text !== scene.text) files[`edited-${scene.file}`] = new TextEncoder().encode(text);
    if (!result) {
        result = await new Promise((resolve, reject) => {
            waiting = { resolve, reject };
            worker.postMessage({ words: list, outputs, files });
        });
        if (result.status < 0) start();
        else if (list[0] !== 'compare') results.set(key, result);
        if (results.size > 60) results.delete(results.keys().next().value);
    }
    if (result.status < 0 || result.status > allowed) throw new Error(result.complaints || `wisp ends with ${result.status}`);
    return result;
}

// ---- Showing
let blobs = [];
const url = (bytes) => blobs[blobs.push(URL.createObjectURL(new Blob([bytes], { type: 'image/png' }))) - 1];
const say = (id, text = '', kind = '') => {
    at(id).textContent = text;
    at(id).className = kind;
    if (id === 'fault' || id === 'notes') at(id).hidden = !text;
};
function progress(stage, percent) {
    at('progress').value = percent;
    say('state', `${pass}: ${stage}, ${percent} %`);
}
let pass = '';      // what is being made, in words
let turn = 0;       // counts what was asked for
let pixel;          // [x, y] of the picture that is explained
// The picture that the page opens on: the build stored it, and what wisp renders of the same words has the same bits.
const stored = { ...at('picture').dataset, png: at('picture').src };
const isStored = () => tab() === 'picture' && arith() === 'f32' && edited() === scene.text && words(false).join(' ') === stored.words;
let opened;         // milliseconds from the beginning of the page until wisp has rendered a picture

// Does `job`, after ending what is running. Its error is shown.
async function work(job) {
    stop();
    const mine = ++turn;
    say('fault');
    at('cancel').disabled = false;
    document.body.dataset.busy = '1';
    try {
        await job();
    } catch (error) {
        if (mine !== turn) return;
        if (error === stopped) return;
        say('fault', error.message, 'bad');
        for (const id of ['state', 'caption', 'verdict', 'notes']) say(id);
        at('picture').removeAttribute('src');
    } finally {
        if (mine === turn) {
            at('cancel').disabled = true;
            at('progress').value = 0;
            delete document.body.dataset.busy;
        }
    }
}

async function show(coarse) {
    if (isStored()) at('picture').src = stored.png;
    pass = golden() ? 'The golden\'s settings' : isStored() ? 'This picture came with the page. Rendered here' : coarse ? 'Coarse picture' : 'Fine picture';
    say('state', `${pass} ...`);
    const picture = tab() === 'picture';
    const list = [...words(coarse), '--arith', arith()];
    if (!picture && sliders.slice.stages.includes(tab()) && state.slice !== undefined) list.push('--slice', state.slice);
    if (sliders.lamp.stages.includes(tab()) && state.lamp !== undefined) list.push('--light', state.lamp);
    if (tab() === 'tree' && state.row !== undefined)
        list.push('--row', String(Math.round(chosen('row') * (size()[1] - 1) / (coarse ? 2 : 1))));
    const command = picture ? ['render', ...list] : ['show', tab(), ...list];
    const begin = performance.now();
    const { said, complaints, made } = await run([...command, ...(picture ? ['--digest'] : []), '--progress', 'always', '-o', 'picture.png'], ['picture.png']);
    paint(made['picture.png']);
    at('command').textContent = `wisp ${command.join(' ')} -o picture.png`;
    say('state', `${size().map((side) => coarse && !golden() ? Math.round(side / 2) : side).join(' x ')} pixels in ${((performance.now() - begin) / 1000).toFixed(2)} s`);
    say('notes', picture && !coarse ? complaints : '');
    opened ??= performance.now();
    if (picture) judge(said.slice(0, 64));
    else say('caption', complaints); // the legend is a note
}
function paint(png) {
    blobs.splice(0).forEach(URL.revokeObjectURL);
    at('picture').src = at('png').href = url(png);
    at('picture').alt = `${scene.name}, ${tab()}`;
    at('png').download = `${scene.file.replace(/\.\w+$/, '')}-${tab()}.png`;
    at('stage').style.aspectRatio = size().join(' / ');
}
// Only what has a golden, or is stored, is judged.
function judge(digest) {
    say('caption', `SHA-256 of the floats: ${digest}`);
    const expected = isStored() ? stored.digest : golden() && goldens.get(`${arith()}  ${words(false).join(' ')}`);
    const whose = isStored() ? 'that of the picture that the page came with' : 'the golden\'s';
    if (!expected) say('verdict');
    else if (expected === digest) say('verdict', `The SHA-256 is ${whose}: the picture has the same bits.`, 'good');
    else say('verdict', `The SHA-256 DIFFERS from ${whose}.`, 'bad');
}

// The three arithmetics beside each other, and their differences.
async function showArithmetics() {
    const figures = [], made = {};
    const draw = () => {
        at('pictures').innerHTML = '';
        blobs.splice(0).forEach(URL.revokeObjectURL);
        for (const { name, png, text } of figures) {
            const figure = document.createElement('figure'), image = new Image(), caption = document.createElement('figcaption');
            image.src = url(png);
            image.alt = name;
            caption.textContent = text;
            figure.append(image, caption);
            at('pictures').append(figure);
        }
        at('png').href = url(figures.at(-1).png);
        at('png').download = `${scene.file.replace(/\.\w+$/, '')}-${figures.at(-1).name.replace(/\W+/g, '-')}.png`;
    };
    for (const name of ['f32', 'f64', 'fixed']) {
        pass = name;
        say('state', `${pass} ...`);
        const command = ['render', ...words(false), '--arith', name];
        const { said, made: files } = await run([...command, '--digest', '--progress', 'always', '-o', 'picture.png', '-o', 'picture.pfm'], ['picture.png', 'picture.pfm']);
        made[`${name}.pfm`] = files['picture.pfm'];
        figures.push({ name, png: files['picture.png'], text: `${name}, SHA-256 ${said.slice(0, 12)}...` });
        draw();
    }
    for (const other of ['f64', 'fixed']) {
        const { said, made: files } = await run(['compare', 'f32.pfm', `${other}.pfm`, '--diff', 'difference.png'], ['difference.png'], made, 1);
        const figure = (name) => said.match(new RegExp(`^${name}\\s+(\\S.*)$`, 'm'))?.[1];
        figures.push({ name: `f32 - ${other}`, png: files['difference.png'],
                       text: `f32 and ${other}: ${figure('differing pixels')} differ, relative RMSE ${figure('relative RMSE')}, mean FLIP ${figure('mean FLIP')}` });
        draw();
    }
    say('state', `${size().join(' x ')} pixels, three times`);
    say('caption', 'The arithmetics differ by rounding, and with photons by noise.');
    at('command').textContent = 'wisp compare f32.pfm fixed.pfm --diff difference.png';
}

// Makes what the settings ask for, and shows them.
function refresh() {
    write();
    controls();
    const several = tab() === 'arithmetics';
    at('stage').hidden = several;
    at('pictures').hidden = !several;
    at('rays').style.display = tab() === 'picture' ? '' : 'none';
    for (const id of ['verdict', 'caption', 'notes']) say(id);
    return work(async () => {
        if (several) return showArithmetics();
        if (!golden() && !isStored()) await show(true);
        await show(false);
        if (tab() === 'picture' && pixel) await explain();
    });
}
function change(id, value) {
    if (value === undefined) delete state[id];
    else state[id] = value;
    forget();
    return refresh();
}

// ---- A pixel
function forget() {
    pixel = undefined;
    delete state.pixel;
    at('rays').innerHTML = at('plot').innerHTML = '';
    at('inspection').hidden = at('legend').hidden = true;
    say('hint', 'Click the picture, or focus it and press the arrow keys and Enter.');
}
// From places in the scene to those in the picture, as wisp's camera has it: `place` gives column, row and depth.
function camera() {
    const number = '\\s+(\\S+)', point = number.repeat(3);
    const v = edited().match(new RegExp(`^\\s*v\\s+from${point}\\s+at${point}\\s+up${point}\\s+angle${number}`, 'm'))?.slice(1).map(Number);
    if (!v) return undefined;
    const [width, height] = size();
    const from = v.slice(0, 3), ahead = unit(minus(v.slice(3, 6), from)), right = unit(cross(ahead, v.slice(6, 9))), up = cross(right, ahead);
    const side = 2 * Math.tan(v[9] * Math.PI / 360) / Math.max(height - 1, 1);
    return (p) => {
        const d = minus(p, from), depth = dot(d, ahead);
        return [width / 2 + dot(d, right) / depth / side, height / 2 - dot(d, up) / depth / side, depth];
    };
}
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a, b) => a.map((x, i) => x - b[i]);
const along = (a, direction, distance) => a.map((x, i) => x + direction[i] * distance);
const unit = (a) => a.map((x) => x / Math.sqrt(dot(a, a)));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

async function explain() {
    const [x, y] = pixel;
    pass = `Pixel ${x} ${y}`;
    say('state', `${pass} ...`);
    cursor();
    const [file, ...options] = words(false);
    const list = ['inspect', file, String(x), String(y), ...options, '--arith', arith()];
    const { said } = await run([...list, '--json']);
    const inspection = JSON.parse(said);
    draw(inspection);
    plot(inspection);
    at('legend').hidden = false;
    at('inspection').textContent = (await run(list)).said;
    at('inspection').hidden = false;
    say('hint', `Pixel ${x} ${y}, as wisp inspect explains it. Its rays are drawn into the picture.`);
    say('state', `Pixel ${x} ${y} is explained below.`);
}
function ask(x, y) {
    forget();
    pixel = [x, y];
    state.pixel = pixel.join();
    write();
    cursor();
    if (!document.body.dataset.busy) work(explain); // else when the picture is done
}
function svgPath(kind, d) {
    const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
    path.setAttribute('class', kind);
    path.setAttribute('d', d);
    at('rays').append(path);
}
// A cross around the pixel, on a picture without rays.
function cursor() {
    const [width, height] = size(), [x, y] = [pixel[0] + 0.5, pixel[1] + 0.5], r = width / 40, gap = width / 160;
    at('rays').setAttribute('viewBox', `0 0 ${width} ${height}`);
    at('rays').innerHTML = '';
    const d = `M${x - r} ${y}H${x - gap}M${x + gap} ${y}H${x + r}M${x} ${y - r}V${y - gap}M${x} ${y + gap}V${y + r}`;
    svgPath('edge', d);
    svgPath('cross', d);
}
// The rays of the first sample that do not begin at the eye: reflected and refracted ones, and those to lights.
function draw({ samples: [{ ray }] }) {
    const place = camera();
    if (!place) return;
    const line = (kind, from, to) => {
        let a = from, b = to;
        const near = 1e-3 * place(ray.hit?.point ?? along(ray.origin, ray.direction, ray.march?.end ?? 1))[2];
        const depths = [place(a)[2], place(b)[2]];
        if (Math.max(...depths) <= near) return;
        const cut = (near - depths[0]) / (depths[1] - depths[0]);
        if (depths[0] < near) a = along(from, minus(to, from), cut);
        if (depths[1] < near) b = along(from, minus(to, from), cut);
        svgPath(kind, `M${place(a).slice(0, 2)}L${place(b).slice(0, 2)}`);
    };
    const lights = (point, list) => {
        for (const { direction, distance, blocked } of list ?? [])
            if (distance !== null && direction) line(blocked ? 'dark' : 'lit', point, along(point, direction, -distance)); // light comes along it
    };
    const visit = (ray) => {
        const end = ray.hit?.point ?? along(ray.origin, ray.direction, ray.march?.end || 10);
        if (ray.kind !== 'camera') line(ray.kind, ray.origin, end);
        if (ray.hit) lights(ray.hit.point, ray.hit.lights);
        const steps = ray.march?.samples ?? [];
        const brightest = steps.reduce((best, s) => s.extinction * s.transmittance > (best ? best.extinction * best.transmittance : 0) ? s : best, undefined);
        if (brightest) lights(along(ray.origin, ray.direction, brightest.distance), brightest.lights);
        for (const next of ray.hit?.rays ?? []) visit(next);
    };
    visit(ray);
}
// What the march of the pixel's first camera ray meets.
function plot({ samples: [{ ray: { march } }] }) {
    if (!march?.samples.length) {
        at('plot').innerHTML = '<p>The first camera ray of this pixel meets no smoke.</p>';
        return;
    }
    const right = 600, top = 10, bottom = 190;
    const x = (distance) => right * (distance - march.begin) / (march.end - march.begin);
    const height = (part) => bottom - (bottom - top) * part;
    // As long as the steps are; where there are none is no smoke: there it is what it is before step i.
    const curve = (kind, of, between) => {
        let path = `M0 ${height(between(0))}`, end = march.begin;
        march.samples.forEach((s, i) => {
            const from = s.distance - s.length / 2;
            if (from > end + s.length / 100) path += `H${x(end)}V${height(between(i))}`;
            path += `H${x(from)}V${height(of(s))}`;
            end = from + s.length;
        });
        path += `H${x(end)}V${height(between(march.samples.length))}H${right}`;
        return `<path class="${kind}" d="${path}"/>`;
    };
    const light = ({ single, multiple }) => mean(single) + mean(multiple);
    const densest = Math.max(...march.samples.map((s) => s.extinction)), brightest = Math.max(...march.samples.map(light));
    at('plot').innerHTML = `
        <p><span class="extinction">extinction, up to ${densest.toPrecision(3)}</span>
            <span class="light">light scattered in, up to ${brightest.toPrecision(3)}</span>
            <span class="transmittance">transmittance, 1 to ${march.transmittance.toPrecision(3)}</span>
            <span>from ${march.begin.toPrecision(4)} to ${march.end.toPrecision(4)} before the eye</span></p>
        <svg viewBox="0 0 600 200" preserveAspectRatio="none" role="img" aria-label="Extinction, light and transmittance along the ray">
            ${curve('extinction', (s) => s.extinction / densest, () => 0)}
            ${curve('light', (s) => light(s) / (brightest || 1), () => 0)}
            ${curve('transmittance', (s) => s.transmittance, (i) => (march.samples[i] ?? march).transmittance)}
        </svg>`;
}

// ---- Controls
function build() {
    for (const name of tabs) {
        const button = document.createElement('button');
        Object.assign(button, { type: 'button', id: `tab-${name}`, textContent: name });
        button.setAttribute('role', 'tab');
        button.setAttribute('aria-controls', 'panel');
        button.onclick = () => { state.tab = name; refresh(); };
        at('tabs').append(button);
    }
    at('tabs').onkeydown = (event) => {
        const i = tabs.indexOf(tab()), to = { ArrowRight: i + 1, ArrowLeft: i - 1, Home: 0, End: -1 }[event.key];
        if (to === undefined) return;
        event.preventDefault();
        state.tab = tabs.at(to % tabs.length);
        refresh();
        at(`tab-${tab()}`).focus();
    };
    for (const [id, { label, values, stages }] of Object.entries(sliders)) {
        const element = document.createElement('label');
        element.htmlFor = id;
        element.innerHTML = `${label} <output id="${id}-value"></output><input id="${id}" type="range" min="0" max="${values.length - 1}">`;
        at(stages ? 'cuts' : 'sliders').append(element);
        at(id).oninput = () => change(id, String(values[at(id).value]));
    }
    for (const id of ['arith', 'size']) at(id).onchange = () => change(id, at(id).value);
    at('scene').onchange = () => choose(at('scene').value);
    at('reset').onclick = () => choose(state.scene);
    at('cancel').onclick = () => {
        stop();
        say('state', 'Cancelled.');
    };
    at('link').onclick = async () => {
        const copied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false);
        say('state', (copied ? 'The link is copied.' : 'The link is the address of this page.') + (scene.dropped ? ' It holds the settings, not your file.' : ''));
    };
    at('aff').onclick = () => {
        const text = `# wisp ${at('command').textContent.slice(5)}\n${edited()}`;
        at('aff').href = URL.createObjectURL(new Blob([text], { type: 'text/plain' }));
        at('aff').download = words(false)[0];
    };
    at('aff').href = '#';
    at('stage').onclick = (event) => {
        const box = at('stage').getBoundingClientRect(), [width, height] = size();
        const scale = Math.min(box.width / width, box.height / height);
        const x = Math.floor((event.clientX - box.left - (box.width - scale * width) / 2) / scale);
        const y = Math.floor((event.clientY - box.top - (box.height - scale * height) / 2) / scale);
        if (tab() === 'picture' && x >= 0 && y >= 0 && x < width && y < height) ask(x, y);
    };
    let cross; // where the keys have moved it
    at('stage').onkeydown = (event) => {
        const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
        if (tab() !== 'picture' || (!by && event.key !== 'Enter')) return;
        event.preventDefault();
        const limits = size();
        cross = pixel ?? cross ?? limits.map((side) => side >> 1);
        if (!by) return ask(...cross);
        if (pixel) forget();
        cross = cross.map((c, i) => Math.min(limits[i] - 1, Math.max(0, c + by[i] * (event.shiftKey ? 10 : 1))));
        pixel = cross;
        cursor();
        pixel = undefined;
        say('hint', `Pixel ${cross.join(' ')}: Enter explains it.`);
    };
    at('file').onchange = () => drop([...at('file').files]);
    document.ondragover = (event) => {
        event.preventDefault();
        at('drop').classList.add('over');
    };
    document.ondragleave = () => at('drop').classList.remove('over');
    document.ondrop = (event) => {
        event.preventDefault();
        at('drop').classList.remove('over');
        drop([...event.dataTransfer.files]);
    };
    onhashchange = () => open();
}
// Makes the controls show the state.
function controls() {
    at('scene').replaceChildren(...Object.entries(scenes).map(([key, { name }]) => new Option(name, key, false, key === state.scene)));
    at('sentence').textContent = scene.sentence;
    at('arith').value = arith();
    const own = scene.text.match(/\bresolution\s+(\d+)\s+(\d+)/)?.slice(1).map(Number) ?? [400, 300];
    at('size').replaceChildren(...[160, 320, 480, 640].map((width) => new Option(`${width} x ${Math.round(width * own[1] / own[0])}`, width)),
                               ...(scene.golden ? [new Option('as the golden', 'golden')] : []));
    at('size').value = state.size ?? 320;
    for (const name of tabs) {
        at(`tab-${name}`).setAttribute('aria-selected', name === tab());
        at(`tab-${name}`).tabIndex = name === tab() ? 0 : -1;
    }
    at('panel').setAttribute('aria-labelledby', `tab-${tab()}`);
    for (const [id, { values, say, smoke, stages }] of Object.entries(sliders)) {
        const value = chosen(id);
        at(id).value = values.reduce((best, v, i) => Math.abs(v - value) < Math.abs(values[best] - value) ? i : best, 0);
        at(`${id}-value`).textContent = say(value);
        at(id).setAttribute('aria-valuetext', say(value));
        at(id).disabled = Boolean(smoke && !hasSmoke());
        if (stages) at(id).parentElement.hidden = !stages.includes(tab());
    }
    at('cut').hidden = !Object.values(sliders).some(({ stages }) => stages?.includes(tab()));
}

// ---- Scenes and files
function choose(key) {
    state = { scene: key, ...(state.tab && { tab: state.tab }), ...(state.arith && { arith: state.arith }) };
    scene = scenes[key];
    forget();
    return refresh();
}
// As the link says.
function open() {
    read();
    scene = scenes[state.scene];
    const asked = state.pixel?.split(',').map(Number);
    forget();
    if (asked?.length === 2) {
        pixel = asked;
        state.pixel = asked.join();
    }
    return refresh();
}
// Files of a user: a scene with what it names, or smoke by itself, about which wisp makes a scene.
async function drop(list) {
    if (!list.length) return;
    const added = {};
    for (const file of list) {
        let bytes = new Uint8Array(await file.arrayBuffer()), name = file.name;
        if (bytes[0] === 0x1f && bytes[1] === 0x8b) {
            try {
                bytes = new Uint8Array(await unpacked(bytes, '').arrayBuffer());
                name = name.replace(/\.gz$/i, '');
            } catch { } // wisp says what is wrong with it
        }
        added[name] = bytes;
    }
    Object.assign(dropped, added);
    results.clear();
    const names = Object.keys(added), file = names.find((name) => /\.(aff|nff)$/i.test(name)) ?? names[0];
    await work(async () => {
        pass = file;
        say('state', `${file} ...`);
        if (/\.(aff|nff)$/i.test(file)) {
            await run(['plan', file, '--quiet'], [], added);
            scenes.dropped = { name: file, file, text: new TextDecoder().decode(added[file]), sentence: 'Your scene.' };
        } else {
            const { made } = await run(['plan', file, '--write-scene', 'chosen.aff', '--quiet'], ['chosen.aff'], added);
            scenes.dropped = { name: file, file: 'chosen.aff', text: new TextDecoder().decode(made['chosen.aff']),
                               sentence: 'Your file. wisp has chosen camera, lights and extinction.' };
            dropped['chosen.aff'] = made['chosen.aff'];
            worker.postMessage({ files: dropped });
        }
        Object.assign(scenes.dropped, { options: /^\s*a\s/m.test(scenes.dropped.text) ? ['--frames', '0'] : [], dropped: true });
        queueMicrotask(() => choose('dropped'));
    });
    at('file').value = '';
}

(async () => {
    if (location.hash) at('picture').removeAttribute('src'); // the link's own is to come
    build();
    start(); // reads its source meanwhile
    const compiled = WebAssembly.compileStreaming(unpacked(bytesOf(at('wasm').textContent), 'application/wasm'));
    const packed = await unpacked(bytesOf(at('files').textContent), 'application/json').json();
    fixtures = Object.fromEntries(Object.entries(packed).map(([name, text]) => [name, bytesOf(text)]));
    for (const [key, preset] of Object.entries(presets)) {
        const file = preset.golden.split(' ')[0];
        const text = new TextDecoder().decode(fixtures[file]);
        scenes[key] = { ...preset, file, text };
    }
    module = await compiled;
    worker.postMessage({ module, files: fixtures });
    open();
})().catch((error) => say('fault', `This browser does not run it: ${error.message}`, 'bad'));
