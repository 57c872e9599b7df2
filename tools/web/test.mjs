// Clicks through build/web/index.html in headless Chromium, and leaves a look at it as build/web/page.png. Status 1 where
// a picture differs from its golden, where the page does other than it should, and where it reaches for the network.
// Usage: node tools/web/test.mjs, from the top folder, after tools/web/build and
// `npm install --prefix build/web playwright-core`. CHROMIUM is the browser, /usr/bin/chromium.
import { createRequire } from 'node:module';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

const { chromium } = createRequire(resolve('build/web/index.html'))('playwright-core');
const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--headless', '--no-sandbox', '--disable-gpu', '--disable-background-networking', '--disable-component-update',
           '--disable-sync', '--no-first-run'],
});
const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
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
const rendered = async () => {
    await page.waitForFunction(() => !busy && request);
    return { verdict: await text('verdict'), digest: (await text('digest')).slice(-64) };
};
const same = 'The picture equals the golden.', none = 'There is no golden for these settings.';

await page.goto(pathToFileURL(resolve('build/web/index.html')).href);
await page.waitForFunction(() => scenes || at('verdict').className === 'other');
const names = await page.$$eval('#scene option', (options) => options.map((o) => o.text));
expect(names.length === 6, `${names.length} scenes`);
for (const [i, name] of names.entries())
    for (const [k, arithmetic] of ['f32', 'f64', 'fixed'].entries()) {
        await page.selectOption('#scene', String(i));
        await page.selectOption('#arithmetic', String(k));
        const { verdict, digest } = await rendered();
        expect(verdict === same && /^[0-9a-f]{64}$/.test(digest),
               `${arithmetic}  ${name}: ${digest.slice(0, 12)} ${await text('seconds')} ${verdict}`);
    }

// A pixel, the one in the middle where no position is given, as it is explained and as it is in the picture.
async function inspected(what, position) {
    await page.click('#canvas', { position });
    await page.waitForFunction(() => !busy);
    const inspection = await text('inspection');
    const [, x, y] = inspection.match(/: pixel (\d+) (\d+) of/) ?? [];
    const sums = inspection.match(/^pixel (.*)$/m)?.[1].split(' ').map(Number).map(Math.fround);
    const shown = await page.evaluate(([x, y]) => [...picture.slice(3 * (y * request.width + x)).slice(0, 3)], [+x, +y]);
    expect(sums?.length === 3 && sums.every((sum, i) => sum === shown[i]), `${what}: pixel ${x} ${y} is ${sums}`);
    return inspection;
}

await page.selectOption('#scene', { label: names.find((name) => name.startsWith('surfaces')) });
await rendered();
expect(/hits triangle \d+.*\n(.*\n)*.*(in shadow|not in shadow)/.test(await inspected('surfaces')), 'hits and shadows are shown');
expect((await page.$('#plot svg')) === null, 'there is no plot without smoke');

await page.selectOption('#scene', '0');
const { digest: first } = await rendered();
await page.fill('#photons', '5000');
await page.click('#render');
let now = await rendered();
expect(now.verdict === none && now.digest !== first, 'other photons, no golden');
await page.click('#reset');
now = await rendered();
expect(now.verdict === same && now.digest === first, 'as it was');
await page.fill('#step', '2');
await page.click('#render');
now = await rendered();
expect(now.verdict === none && now.digest !== first, 'another step, no golden');
await page.click('#reset');
await rendered();

const drag = async (right, down) => {
    const box = await page.locator('#canvas').boundingBox();
    const x = box.x + box.width / 2, y = box.y + box.height / 2;
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + right, y + down, { steps: 4 });
    await page.mouse.up();
    return rendered();
};
now = await drag(80, 30);
expect(now.verdict === none && now.digest !== first, 'a turned camera, no golden');
await inspected('turned');
now = await drag(-80, -30);
expect(now.verdict === same && now.digest === first, 'turned back');

// What comes later is not painted yet when the first rows are.
const painted = () => {
    const alpha = (y) => at('canvas').getContext('2d').getImageData(0, y, 1, 1).data[3];
    return busy && alpha(0) === 255 && alpha(at('canvas').height - 1) === 0;
};
await page.selectOption('#size', '8');
await page.waitForFunction(painted, undefined, { polling: 20 });
expect(true, 'rows are painted as they come');
await page.click('#reset');
now = await rendered();
expect(now.verdict === same && now.digest === first, 'as it was, without waiting for the end');

await page.selectOption('#size', '4');
now = await rendered();
expect(now.verdict === none && (await page.evaluate(() => picture.length)) === 3 * 256 * 192, '4 x 4 as many pixels');
const passage = await inspected('passage', { x: 262, y: 180 });
expect(/\bstep \d+ at .*extinction/.test(passage), 'steps of the march are shown');
expect((await page.$$('#plot svg path')).length === 3, 'they are plotted');
await page.screenshot({ path: 'build/web/page.png', fullPage: true });
await page.setViewportSize({ width: 390, height: 844 });
expect(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'it fits 390 pixels');
await page.screenshot({ path: 'build/web/narrow.png', fullPage: true });

await browser.close();
console.log(failures ? `${failures} FAILED` : 'all is well');
process.exit(failures ? 1 : 0);
