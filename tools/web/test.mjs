// Uses build/web/index.html in headless Chromium, and leaves looks at it as build/web/page.png and narrow.png. Status 1 where a
// picture differs from its golden, where the page does other than it should, and where it reaches for the network.
// Usage: node tools/web/test.mjs, from the top folder, after `make web-deps web`. CHROMIUM is the browser, /usr/bin/chromium.
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { gzipSync } from 'node:zlib';

const { chromium } = createRequire(resolve('build/web/index.html'))('playwright-core');
const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--headless', '--no-sandbox', '--disable-gpu', '--disable-background-networking', '--disable-component-update',
           '--disable-sync', '--no-first-run'],
});
const page = await browser.newPage({ viewport: { width: 1280, height: 900 }, acceptDownloads: true });
page.setDefaultTimeout(300000); // however busy the machine is
let failures = 0;
const expect = (so, what) => {
    if (!so) ++failures;
    console.log(`${so ? 'ok    ' : 'FAILED'}  ${what}`);
};
page.on('console', (message) => message.type() === 'error' && expect(false, `console: ${message.text()}`));
page.on('pageerror', (error) => expect(false, `page: ${error.message}`));
page.on('request', (request) => /^(file|blob|data):/.test(request.url()) || expect(false, `request: ${request.url()}`));

const text = (id) => page.textContent(`#${id}`);
const idle = () => page.waitForFunction(() => typeof scene === 'object' && !document.body.dataset.busy);
const address = pathToFileURL(resolve('build/web/index.html')).href;
// With the settings of a link, as a reader of the link has it.
async function open(settings = '') {
    await page.evaluate((hash) => { location.hash = hash; }, settings);
    await page.waitForFunction((hash) => Object.entries(Object.fromEntries(new URLSearchParams(hash))).every(([key, value]) => state[key] === value), settings);
    await idle();
}
// The sides of the picture that is shown, and the sum of its values; of none where there is no picture.
const sums = () => page.evaluate(async () => {
    const image = at('picture');
    if (!image.src) return { width: 0, height: 0, sum: 0 };
    await image.decode();
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    return { width: canvas.width, height: canvas.height, sum: data.reduce((a, b) => a + b, 0) - 255 * data.length / 4 };
});

// ---- It opens on a picture
// A picture that the page came with, which wisp then renders: the browser has painted the one (LCP) before the other is there.
await page.goto(address);
await page.waitForFunction(() => typeof opened === 'number');
await idle();
const [painted, rendered] = await page.evaluate(() => new Promise((done) =>
    new PerformanceObserver((list) => done([list.getEntries().find((entry) => entry.element?.id === 'picture')?.startTime, opened]))
        .observe({ type: 'largest-contentful-paint', buffered: true })));
let now = await sums();
expect(now.width === 320 && now.height === 240 && now.sum > 320 * 240 * 30 && painted < rendered,
       `the first picture: painted after ${(painted / 1000).toFixed(2)} s, rendered after ${(rendered / 1000).toFixed(2)} s`);
expect(/came with: the picture has the same bits/.test(await text('verdict')) && (await page.getAttribute('#verdict', 'class')) === 'good',
       'it has the bits of the picture that the page came with');
await open('scene=wake&photons=50000');
expect((await text('verdict')) === '' && /SHA-256/.test(await text('caption')), 'without a golden, the page claims nothing');
await page.screenshot({ path: 'build/web/page.png', fullPage: true });

// ---- The same bits
const keys = await page.$$eval('#scene option', (options) => options.map((o) => o.value));
for (const key of keys)
    for (const arith of ['f32', 'f64', 'fixed']) {
        await open(`scene=${key}&size=golden&arith=${arith}`);
        const digest = (await text('caption')).slice(-64);
        const golden = await page.evaluate(() => `${arith()}  ${scene.golden}`);
        expect(readFileSync('fixtures/goldens.txt', 'utf8').includes(`${digest}  ${golden}\n`) && (await page.getAttribute('#verdict', 'class')) === 'good',
               `${golden}: ${digest.slice(0, 12)}, ${await text('state')}`);
    }
for (const key of keys) {
    await open(`scene=${key}&size=160`);
    expect((await text('fault')) === '' && (await sums()).width === 160, `${key}: ${await text('state')}`);
}

// ---- Stages, arithmetics
const tabs = await page.$$eval('[role=tab]', (all) => all.map((tab) => tab.textContent));
expect(tabs.join(' ') === 'picture arithmetics density depth light-depth photons paths nodes tree visits proofs wrong', `${tabs.length} tabs`);
await open('scene=wake&size=160');
for (const tab of tabs.slice(2)) {
    await page.click(`#tab-${tab}`);
    await idle();
    now = await sums();
    expect((await text('fault')) === '' && now.width === 160 && now.sum >= 0 && new RegExp(`^${tab}: `).test(await text('caption')), `${tab}: ${(await text('caption')).slice(0, 80)}`);
}
await open('scene=wake&size=160&tab=density&slice=0.2');
const near = (await sums()).sum;
await open('scene=wake&size=160&tab=density&slice=0.6');
expect((await sums()).sum !== near, 'the plane moves');
await open('scene=plume&size=160&tab=tree');
expect(/error: /.test(await text('fault')), `a stage that the scene does not need: ${await text('fault')}`);
await open('scene=forward&size=160&tab=arithmetics');
const figures = await page.$$eval('figcaption', (all) => all.map((one) => one.textContent));
expect(figures.length === 5 && figures.slice(3).every((caption) => /relative RMSE [\d.e-]+/.test(caption)), figures.slice(3).join('; '));

// ---- Sliders, the link
await open('scene=wake&size=160');
const before = (await sums()).sum;
for (const id of ['photons', 'step', 'g', 'albedo', 'extinction', 'light']) {
    await open('scene=wake&size=160');
    await page.focus(`#${id}`);
    for (let i = 0; i < 2; ++i) await page.keyboard.press('ArrowLeft');
    await idle();
    const { sum } = await sums(), link = await page.evaluate(() => location.href);
    expect(sum !== before && (await text('fault')) === '', `${id} ${await text(`${id}-value`)} changes the picture`);
    expect(new URL(link).hash.includes(`${id}=`), `the link holds ${id}`);
    if (id !== 'g') continue;
    await page.goto('about:blank');
    await page.goto(link);
    await idle();
    expect((await sums()).sum === sum && (await text('g-value')).startsWith('-0.2'), 'the link gives the same picture');
}
await open('scene=forward&size=golden&light=2');
expect((await text('verdict')) === '', 'no golden for a changed scene');

// ---- Files of one's own
async function give(...files) {
    const before = await page.evaluate(() => turn);
    await page.setInputFiles('#file', files);
    await page.waitForFunction((before) => turn > before, before);
    await idle();
}
const file = (name, buffer = readFileSync(`fixtures/${name}`)) => ({ name, mimeType: 'application/octet-stream', buffer });
await open('scene=forward');
await give(file('plume.vtk'));
now = await sums();
expect((await text('fault')) === '' && now.width === 320 && now.sum > 0 && (await page.inputValue('#scene')) === 'dropped', `plume.vtk: ${now.width} x ${now.height}`);
const whole = now.sum;
await give(file('plume.vtk.gz', gzipSync(readFileSync('fixtures/plume.vtk'))));
expect((await sums()).sum === whole, 'plume.vtk.gz is the same');
await give(file('puff.vol'));
expect((await text('fault')) === '' && (await sums()).sum !== whole, 'puff.vol');
await give(file('mine.aff', readFileSync('fixtures/grid.aff')), file('puff.vol'));
expect((await text('fault')) === '' && (await text('sentence')) === 'Your scene.', 'a scene with its grid');
await give(file('broken.vtk', readFileSync('fixtures/plume.vtk').subarray(0, 5000)));
expect(/broken\.vtk.*error: /.test(await text('fault')), `a broken file: ${await text('fault')}`);
await give(file('nonsense.aff', Buffer.from('v from nowhere\n')));
expect(/nonsense\.aff:1: error: /.test(await text('fault')), `a broken scene: ${await text('fault')}`);
await page.evaluate((words) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([words], 'box.aff'));
    document.dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
}, 'v from 0 -6 1 at 0 0 0 up 0 0 1 angle 30 hither 0.1 resolution 40 30\nld -1 1 -1 3 2 1\nsmoke box -1 -1 -1 1 1 1 0.5 { }\n');
await page.waitForFunction(() => scene.file === 'box.aff');
await idle();
expect((await text('fault')) === '' && (await sums()).sum > 0, 'a file that is dropped on the page');

// ---- A pixel
await open('scene=surfaces&size=320');
await page.click('#stage', { position: { x: 250, y: 330 } });
await idle();
const explained = await text('inspection');
expect(/hits triangle \d+/.test(explained), `surfaces: ${explained.slice(0, 60)}`);
expect((await page.$$('#rays path:not(.cross):not(.edge)')).length > 1 && (await page.$('#plot svg')) === null, 'its rays are drawn, and nothing is plotted');
const off = await page.evaluate(async () => {
    const place = camera(), [x, y] = pixel;
    const [file, ...options] = words(false);
    const { samples } = JSON.parse((await run(['inspect', file, String(x), String(y), ...options, '--arith', 'f32', '--json'])).said);
    return Math.max(...samples.map(({ column, row, ray }) => Math.hypot(...place(ray.hit.point).slice(0, 2).map((v, i) => v - [column, row][i]))));
});
expect(off < 0.01, `what the rays hit is drawn ${off.toExponential(1)} pixels from where it is in the picture`);
await open('scene=wake&pixel=175,105');
expect(/\bstep \d+ at .*extinction/.test(await text('inspection')) && (await page.$$('#plot svg path')).length === 3, 'a link to a pixel in smoke: its steps are shown and plotted');
await page.screenshot({ path: 'build/web/pixel.png', fullPage: true });

// ---- Downloads
async function download(id) {
    const [got] = await Promise.all([page.waitForEvent('download'), page.click(`#${id}`)]);
    return [got.suggestedFilename(), readFileSync(await got.path())];
}
await open('scene=wake&size=160&g=0.5');
await page.click('#link');
await page.waitForFunction(() => /^The link is /.test(at('state').textContent)); // the clipboard takes its time
expect(/^The link is /.test(await text('state')), await text('state'));
const [png, picture] = await download('png');
expect(png === 'wake-picture.png' && picture.subarray(1, 4).toString() === 'PNG', png);
const [aff, words] = await download('aff');
expect(aff === 'edited-wake.aff' && /^# wisp render edited-wake\.aff .*\n(.*\n)*.*phase 0\.5/.test(words.toString()), aff);

// ---- Cancel
await open('scene=grid&size=160');
await page.selectOption('#size', '640');
await page.waitForFunction(() => /Fine.*%/.test(at('state').textContent));
await page.click('#cancel');
await idle();
expect((await text('state')) === 'Cancelled.', 'a picture is cancelled');
await open('scene=forward&size=160');
expect((await sums()).width === 160, 'and the next one is made');

// ---- Keyboard
await page.focus('#tab-picture');
await page.keyboard.press('ArrowLeft');
expect((await page.evaluate(() => document.activeElement.id)) === 'tab-wrong' && (await page.evaluate(() => tab())) === 'wrong', 'arrow keys go through the tabs');
await page.keyboard.press('Home');
await idle();
await page.focus('#stage');
await page.keyboard.press('ArrowRight');
await page.keyboard.press('Shift+ArrowDown');
await page.keyboard.press('Enter');
await idle();
expect(/pixel 81 70 of/.test(await text('inspection')), 'arrow keys and Enter explain a pixel');
const reached = new Set();
await page.evaluate(() => document.activeElement.blur());
for (let i = 0; i < 40; ++i) {
    await page.keyboard.press('Tab');
    const [id, outline] = await page.evaluate(() => [document.activeElement.id, getComputedStyle(document.activeElement).outlineStyle]);
    if (id && !reached.has(id)) {
        reached.add(id);
        if (outline === 'none') expect(false, `the focus on ${id} is seen`);
    }
}
const all = await page.$$eval('button, select, input, a[href], #stage, pre', (list) => list.filter((e) => e.offsetParent && !e.disabled && e.tabIndex >= 0).map((e) => e.id));
expect(all.every((id) => reached.has(id)), `Tab reaches all ${all.length} controls`);
expect((await page.$$eval('input, select', (list) => list.every((e) => e.labels.length))), 'every control has a label');

// ---- Contrast, in both schemes
for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme });
    const [ratio, worst] = await page.evaluate(() => {
        const channels = (color) => color.match(/[\d.]+/g).map(Number);
        const luminance = (rgb) => rgb.slice(0, 3).map((c) => c / 255).map((c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
                                      .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
        const behind = (element) => {
            for (; element; element = element.parentElement) {
                const color = channels(getComputedStyle(element).backgroundColor);
                if (color.length === 3 || color[3] === 1) return color;
            }
        };
        let worst = [Infinity];
        for (const element of document.querySelectorAll('body, body *')) {
            const words = [...element.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
            if (!words || !element.offsetParent || element.disabled) continue;
            const a = luminance(channels(getComputedStyle(element).color)), b = luminance(behind(element));
            const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
            if (ratio < worst[0]) worst = [ratio, element.id || element.textContent.trim().slice(0, 30)];
        }
        return worst;
    });
    expect(ratio >= 4.5, `${colorScheme}: contrast of ${ratio.toFixed(1)} at least, of ${worst}`);
}

// ---- Narrow
await page.setViewportSize({ width: 390, height: 844 });
await open('scene=wake&tab=picture&pixel=175,105');
for (const tab of tabs) {
    await page.click(`#tab-${tab}`);
    await idle();
    expect(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `${tab} fits 390 pixels`);
}
await page.click('#tab-picture');
await idle();
await page.screenshot({ path: 'build/web/narrow.png', fullPage: true });

await browser.close();
console.log(failures ? `${failures} FAILED` : 'all is well');
process.exit(failures ? 1 : 0);
