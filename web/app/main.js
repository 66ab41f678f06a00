// Starts the page: each concern in its own module, all of them fed by the address and the server's events.
import { loadChains, loadScenarios, onCatalog } from "./catalog.js";
import { onPlainClick } from "./dom.js";
import { startLive } from "./live.js";
import { complain, senseless, startConnectionSigns } from "./notice.js";
import { startPlayer } from "./player.js";
import { startScenarioForm } from "./scenario_form.js";
import { ELSEWHERE, startScenarioList } from "./scenario_list.js";
import { startScenarioView } from "./scenario_view.js";
import { stage } from "./stage.js";
import { startTheme } from "./theme.js";
import { go, onPlace, takeMisread } from "./url_state.js";

startTheme(document.getElementById("theme"));
startConnectionSigns(document.getElementById("banner"), document.getElementById("connection"));
const noGraphics = document.getElementById("no-webgl");
noGraphics.hidden = stage.works;
stage.canvas.addEventListener("webglcontextlost", () => (noGraphics.hidden = false));
stage.canvas.addEventListener("webglcontextrestored", () => (noGraphics.hidden = true));
stage.enter(document.body, true);
startScenarioList();
startScenarioView();
startScenarioForm();
startPlayer();
document.querySelector(".brand").addEventListener("click", onPlainClick(() => go({ ...ELSEWHERE, scenario: "", choose: "", tab: "animations" })));
for (const [name, value] of takeMisread()) senseless(name, value);

const chains = () => loadChains().catch(complain);
onCatalog(chains);
onPlace((now, before) => now.scenario !== before.scenario && chains());
loadScenarios().catch(complain);
startLive();
