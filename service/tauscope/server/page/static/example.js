// The example's files, as if they had been dropped.

import { fetchRaw } from "./api.js";

const NAMES = ["example-arm.yaml", "example-train.csv", "example-held-out.csv"];

export const exampleFiles = () => Promise.all(NAMES.map(async (name) => new File([await (await fetchRaw(`/example/${name}`)).blob()], name)));
