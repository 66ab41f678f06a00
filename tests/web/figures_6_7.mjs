// Figures 6 and 7 of the paper, from the page's own trace: the filled bins and log p(A) of a walk with the published ratios.
//   RETAKE_PROGRAM=build/release/retake node tests/web/figures_6_7.mjs worlds/spelling/figures_6_7.png [seed] [exact]
import { api, json, newPage, startBrowser, startProgram } from "./fixture.mjs";

const [file, seed = "5", ratios = "paper"] = process.argv.slice(2);
const WORD = { world: "spelling", title: "HI", constraints: [{ kind: "spell", text: "HI", log_lambda: 5 }] };
const WALK = { seed: Number(seed), method: "metropolis", ratios, stop: { iterations: 20_000 } };

const [program, browser] = await Promise.all([startProgram({ world: null, examples: false }), startBrowser({ webgl: false })]);
const { id } = await api(program, "/v1/scenarios", json(WORD));
const [{ id: chain }] = (await api(program, `/v1/scenarios/${id}/chains`, json(WALK))).chains;
while ((await api(program, `/v1/chains/${chain}`)).state !== "finished") await new Promise((resolve) => setTimeout(resolve, 500));

const { page } = await newPage(browser, { viewport: { width: 1180, height: 900 }, colorScheme: "light" });
const curves = [];
for (const quantity of ["filled_bins", "log_target"]) {
  await page.goto(`${program.address}?scenario=${id}&tab=chains&chain=${chain}&quantity=${quantity}`);
  await page.locator(".uplot canvas").waitFor();
  curves.push(await page.locator("section.trace").screenshot({ animations: "disabled" }));
}
await page.goto("about:blank");
await page.setContent(curves.map((curve) => `<img src="data:image/png;base64,${curve.toString("base64")}" style="display:block">`).join(""));
await page.locator("body").evaluate((body) => Object.assign(body.style, { margin: 0, width: "max-content" }));
await page.locator("body").screenshot({ path: file });
await Promise.all([browser.close(), program.end()]);
await program.remove();
