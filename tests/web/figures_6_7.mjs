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
// The paper's chain leaves the area out of which balls are dropped: measured in units of that area, drops have the density 1.
const AREA = (7 * 0.022 - 0.018) * (5 * 0.022 - 0.018); // [m2], spelling::Box::drop_area of 7 x 5
await page.route("**/trace?*", async (route) => {
  const trace = await (await route.fetch()).json();
  const log_prior = trace.log_prior.map((value, at) => value + trace.active_balls[at] * Math.log(AREA));
  await route.fulfill({ json: { ...trace, log_prior } });
});
const curves = [];
for (const quantity of ["filled_bins", "log_target"]) {
  await page.goto(`${program.address}?scenario=${id}&tab=chains&chain=${chain}&quantity=${quantity}`);
  await page.locator(".quantities tbody tr").first().waitFor(); // above the trace: from here on it stays in its place
  const curve = page.locator("section.trace .uplot");
  await curve.locator(".u-legend", { hasText: quantity.replace("_", " ") }).waitFor();
  curves.push(await curve.screenshot({ animations: "disabled" }));
}
await page.goto("about:blank");
const pictures = curves.map((curve) => `<img src="data:image/png;base64,${curve.toString("base64")}" style="display:block">`);
await page.setContent(`<figure style="margin:0;width:max-content">${pictures.join("")}</figure>`);
await page.locator("figure").screenshot({ path: file });
await Promise.all([browser.close(), program.end()]);
await program.remove();
