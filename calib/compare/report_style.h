// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace toftwin::compare {

/// The report's style sheet. Every colour is a variable with a value for light and one for dark
/// pages.
inline constexpr const char* kReportStyle = R"css(
:root{--page:#fbfbf9;--ink:#1b1d1f;--soft:#565b61;--line:#d9dbdd;--panel:#fff;
--measured:#1b1d1f;--simulated:#0072b2;--published:#d55e00;--baseline:#8a8f95;--extra:#009e73;--alert:#cc3377;
--good:#00704f;--fair:#8a5a00;--bad:#b3261e;--neutral:#3b4a59;--hatch:#e4e4e0}
@media(prefers-color-scheme:dark){:root{--page:#15171a;--ink:#e9eaec;--soft:#a5abb3;--line:#343941;--panel:#1d2024;
--measured:#f1f2f4;--simulated:#56b4e9;--published:#f0853a;--baseline:#8a8f95;--extra:#2cc79b;--alert:#e58ab8;
--good:#4fd1a5;--fair:#e6b04c;--bad:#ff8a80;--neutral:#aab8c6;--hatch:#2a2d31}}
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif}
main{max-width:1500px;margin:0 auto;padding:28px 20px 60px}
h1{font-size:1.75rem;line-height:1.2;margin:0 0 4px}
h2{font-size:1.3rem;margin:0 0 8px;line-height:1.25}
.subtitle{color:var(--soft);margin:0 0 16px}
.verdict{font-size:1.12rem;margin:0 0 18px;padding:12px 16px;background:var(--panel);border:1px solid var(--line);border-left:6px solid var(--neutral);border-radius:6px}
.finding{margin:0 0 14px;padding-left:12px;border-left:4px solid var(--neutral);max-width:78ch}
.verdict.good,.finding.good{border-left-color:var(--good)}
.verdict.fair,.finding.fair{border-left-color:var(--fair)}
.verdict.bad,.finding.bad{border-left-color:var(--bad)}
.cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(240px,1fr));gap:12px;margin-bottom:18px}
.card{background:var(--panel);border:1px solid var(--line);border-top:4px solid var(--neutral);border-radius:6px;padding:10px 14px}
.card.good{border-top-color:var(--good)}.card.fair{border-top-color:var(--fair)}.card.bad{border-top-color:var(--bad)}
.cardlabel{font-size:.86rem;color:var(--soft)}
.value{font-size:1.22rem;font-weight:650;font-variant-numeric:tabular-nums;line-height:1.3}
.note{font-size:.84rem;color:var(--soft)}
nav{display:flex;flex-wrap:wrap;gap:6px 16px;font-size:.95rem;padding:8px 0 4px;border-bottom:1px solid var(--line)}
nav a{color:var(--simulated);text-decoration:none;padding:4px 0}nav a:hover,nav a:focus{text-decoration:underline}
section{margin-top:34px;padding-top:6px}
p{max-width:78ch}
.small,details p{font-size:.9rem;color:var(--soft)}
details{margin:10px 0}summary{cursor:pointer;color:var(--soft)}
figure{margin:14px 0;background:var(--panel);border:1px solid var(--line);border-radius:6px;padding:10px 12px;min-width:0}
figcaption{font-size:.9rem;color:var(--soft);margin-top:6px;max-width:90ch}
.row{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,400px),1fr));gap:0 14px}
.plot{overflow-x:auto}.plot svg{display:block;width:100%;min-width:430px;height:auto}
.plot.map svg{min-width:260px}.row .plot svg{min-width:260px}
.legend{display:flex;flex-wrap:wrap;gap:2px 18px;font-size:.9rem;padding:4px 4px 0}.legend span{display:inline-flex;align-items:center;gap:7px}
.legend svg{flex:none}
/* One that stands alone is no wider than one looks at; what it means is beside it. */
@media screen and (min-width:1000px){.alone{display:grid;grid-template:auto 1fr/minmax(0,820px) minmax(220px,1fr);gap:0 24px}
.alone .plot{grid-row:1/3}.alone .legend{flex-direction:column;padding-top:12px}}
.tick{font-size:13px;fill:var(--soft);font-variant-numeric:tabular-nums}.label{font-size:14px;fill:var(--ink)}
.grid{stroke:var(--line);stroke-width:1}.zero{stroke:var(--soft);stroke-width:1.2}.frame{fill:none;stroke:var(--line)}
.curve{fill:none;stroke-width:2;stroke-linejoin:round}.dashed{stroke-dasharray:8 5}.dotted{stroke-dasharray:2 4}
.dots{stroke:none;fill-opacity:.6}.band{stroke:none;fill-opacity:.18}
.nothing{fill:var(--hatch)}
.curve.measured{stroke:var(--measured)}.curve.simulated{stroke:var(--simulated)}.curve.published{stroke:var(--published)}
.curve.baseline{stroke:var(--baseline)}.curve.extra{stroke:var(--extra)}.curve.alert{stroke:var(--alert)}
.dots.measured,.band.measured{fill:var(--measured)}.dots.simulated,.band.simulated{fill:var(--simulated)}
.dots.published,.band.published{fill:var(--published)}.dots.baseline,.band.baseline{fill:var(--baseline)}
.dots.extra,.band.extra{fill:var(--extra)}.dots.alert,.band.alert{fill:var(--alert)}
.scroll{overflow-x:auto;margin:14px 0}
table{border-collapse:collapse;font-size:.92rem;min-width:min(100%,480px);background:var(--panel);border:1px solid var(--line)}
/* Said beside the table's visible part, however wide it is. */
caption{text-align:left;color:var(--soft);font-size:.9rem;padding:0 0 6px}
caption span{display:inline-block;position:sticky;left:0;max-width:min(100%,calc(100vw - 40px))}
th,td{padding:5px 12px;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
th{font-weight:600;vertical-align:bottom}td:first-child:not(.number){min-width:13em}td:nth-child(2):not(.number):not([colspan]){min-width:13em}th.number,td.number{text-align:right}td.number{font-variant-numeric:tabular-nums;white-space:nowrap}
td.long{white-space:normal;min-width:11em}.above td{border-bottom:0;padding-bottom:0}.below td{color:var(--soft);padding:0 12px 6px 28px}
footer{margin-top:40px;padding-top:12px;border-top:1px solid var(--line);color:var(--soft);font-size:.85rem}
@media(max-width:520px){main{padding:18px 12px 40px}.cards{grid-template-columns:1fr 1fr}.card{padding:8px 10px}.value{font-size:1.02rem}h1{font-size:1.4rem}
.plot svg,.row .plot svg{min-width:0}.tick,.label{font-size:16px}.plot.map .tick,.row .tick,.plot.map .label,.row .label{font-size:15px}
/* Rows of a few lines, and their name in sight while one scrolls. */
table{width:max-content}caption span{max-width:calc(100vw - 26px)}
th,td:not([colspan]),td:first-child:not(.number):not([colspan]){padding:5px 8px;min-width:0;max-width:13em}
th:first-child,td:first-child:not([colspan]){position:sticky;left:0;background:var(--panel);max-width:9em;overflow-wrap:anywhere}
td:nth-child(2):not(.number):not([colspan]){min-width:5em}.below td{max-width:0}}
/* A cloud keeps its shape on paper, where it was drawn for the screen's box. */
.cloud canvas{display:block;width:100%;height:420px;object-fit:contain;touch-action:none;cursor:grab}.cloud .hint,.cloud input{display:none}
.cloud.turns .hint{display:inline;color:var(--soft)}.cloud.turns input{display:inline}.inkA{color:var(--measured)}.inkB{color:var(--simulated)}
@media print{caption span{max-width:none}nav,.cloud .hint,.cloud input{display:none!important}
body{background:#fff;font-size:10pt}main{max-width:none;padding:0}
/* Verdict and cards on the first page. */
.cards{grid-template-columns:repeat(4,1fr);gap:6px}.card{padding:4px 8px}
.value{font-size:10.5pt}.cardlabel,.note{font-size:7.5pt}
.verdict{font-size:10.5pt}.small,details p,caption,figcaption,.legend{font-size:8pt}section{margin-top:18px}
figure,.card,tr,caption,h2+p,table.few{break-inside:avoid}
h2,.finding,caption,thead,tr.above,tbody tr:first-child{break-after:avoid}
tbody tr:last-child{break-before:avoid}
.scroll,.plot{overflow:visible}.plot svg{min-width:0;max-height:95mm}
.row{grid-template-columns:1fr 1fr}.row .plot svg{min-width:0;max-height:56mm}.row .plot.tall svg{max-height:80mm}
.cloud canvas{height:240px}#provenance td{overflow-wrap:anywhere}
table{font-size:8pt;width:100%}th,td{padding:2px 5px}td.number{white-space:normal}td.long{min-width:0}.below td{padding:0 5px 2px 16px}td:first-child:not(.number),td:nth-child(2):not(.number){min-width:0}
details::details-content{content-visibility:visible;height:auto}summary{list-style:none}}
)css";

}  // namespace toftwin::compare
