// Make the built files of this folder from the packages that package-lock.json names: node build.mjs FOLDER.
import { copyFileSync } from "node:fs";
import { join } from "node:path";
import { argv } from "node:process";
import { build } from "esbuild";

const out = argv[2];
await build({
  entryPoints: ["three_used.js"],
  bundle: true,
  minify: true,
  format: "iife",
  globalName: "THREE",
  target: "es2022",
  charset: "ascii",
  legalComments: "none",
  banner: { js: "/* three.js, MIT: LICENSE.three */" },
  outfile: join(out, "three.min.js"),
});
copyFileSync("node_modules/uplot/dist/uPlot.iife.min.js", join(out, "uplot.min.js"));
copyFileSync("node_modules/uplot/dist/uPlot.min.css", join(out, "uplot.min.css"));
for (const name of ["three", "uplot"]) {
  copyFileSync(`node_modules/${name}/LICENSE`, join(out, `LICENSE.${name}`));
}
