// Looks at build/report/index.html in headless Chromium, wide and narrow, light and dark, and leaves what it sees as
// build/report/*.png. Status 1 where the page has errors, reaches for the network, or is wider than its window, and where a
// slider does not move. Usage: node tools/measure/report/check.mjs, from the top folder, after `make report` and
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
let failures = 0;
const expect = (so, what) => {
    if (!so) ++failures;
    console.log(`${so ? 'ok    ' : 'FAILED'}  ${what}`);
};
const url = pathToFileURL(resolve('build/report/index.html')).href;

for (const [name, width, colorScheme] of [['wide', 1280, 'light'], ['dark', 1280, 'dark'], ['narrow', 390, 'light']]) {
    const page = await browser.newPage({ viewport: { width, height: 844 }, colorScheme });
    page.on('console', (message) => message.type() === 'error' && expect(false, `${name}: console: ${message.text()}`));
    page.on('pageerror', (error) => expect(false, `${name}: page: ${error.message}`));
    page.on('request', (request) => request.url() === url || request.url().startsWith('data:') ||
        expect(false, `${name}: request: ${request.url().slice(0, 80)}`));
    await page.goto(url);

    expect((await page.$$('section h2')).length >= 12, `${name}: all sections are there`);
    const broken = await page.$$eval('img', (images) => images.filter((i) => !i.complete || !i.naturalWidth).length);
    expect(broken === 0, `${name}: every picture is drawn`);
    const odd = await page.$$eval('.lead, .headline td, .number, li, .plot text, .plot dd', (all) =>
        all.map((element) => element.textContent).find((text) => /\b(nan|inf|None|undefined)\b/.test(text)));
    expect(odd === undefined, `${name}: every figure is a number ${odd ?? ''}`);
    // Folded tables, too.
    await page.$$eval('details', (all) => all.forEach((details) => { details.open = true; }));
    const [wide, out] = await page.evaluate(() => {
        const inBox = (element) => element.closest('.scroll, .compare, svg') && !element.matches('.scroll, .compare, svg');
        const out = [...document.body.querySelectorAll('*')].filter((element) =>
            !inBox(element) && element.getBoundingClientRect().right > innerWidth + 0.5);
        return [document.documentElement.scrollWidth, out.map((element) => element.outerHTML.slice(0, 80))];
    });
    expect(wide <= width && out.length === 0, `${name}: ${wide} of ${width} pixels ${out.slice(0, 3).join(' ')}`);
    await page.$$eval('details', (all) => all.forEach((details) => { details.open = false; }));

    // Small text is text that a scaled plot has made small.
    const sizes = await page.$$eval('.plot text', (texts) => texts.filter((text) => text.getClientRects().length).map((text) => {
        const { a, b } = text.getScreenCTM();
        return Math.hypot(a, b) * parseFloat(getComputedStyle(text).fontSize);
    }));
    expect(sizes.every((size) => size >= 8), sizes.length ? `${name}: text in plots is of ${Math.min(...sizes).toFixed(1)} pixels at least` : `${name}: no plot has text`);

    const sliders = await page.$$('.compare input');
    const without = await page.$$eval('.missing', (all) => all.filter((element) => /\.pfm is missing/.test(element.textContent)).length);
    expect(sliders.length + without >= 3, `${name}: ${sliders.length} pairs of pictures, ${without} pictures missing`);
    if (sliders.length) {
        const edge = () => page.$eval('.compare', (box) => {
            const image = box.querySelector('.over');
            return [getComputedStyle(image).clipPath, +box.querySelector('input').value];
        });
        await sliders[0].focus();
        const [before, at] = await edge();
        await page.keyboard.press('ArrowRight');
        const [after, then] = await edge();
        expect(then > at && after !== before, `${name}: a key moves the slider from ${at} to ${then}`);
        const box = await sliders[0].boundingBox();
        await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
        await page.mouse.down();
        await page.mouse.move(box.x + box.width / 4, box.y + box.height / 2, { steps: 4 });
        await page.mouse.up();
        const [dragged, value] = await edge();
        expect(value < 30 && dragged !== after, `${name}: dragging moves it to ${value}`);
        await sliders[0].evaluate((input) => { input.value = 50; input.dispatchEvent(new Event('input')); input.blur(); });
    }
    await page.evaluate(() => scrollTo(0, 0));
    await page.screenshot({ path: `build/report/${name}.png`, fullPage: true });
    await page.close();
}
await browser.close();
console.log(failures ? `${failures} FAILED` : 'all is well');
process.exit(failures ? 1 : 0);
