// Requests to the server. Every refusal becomes a Problem with the server's own words.

/** A refusal, RFC 9457, or a server that does not answer (status 0). */
export class Problem extends Error {
  /** @param {{status: number, title?: string, detail?: string, errors?: {pointer: string, detail: string}[]}} body */
  constructor(body) {
    super([body.title, body.detail].filter(Boolean).join(": ") || `The server answered ${body.status}`);
    this.status = body.status;
    this.title = body.title ?? "";
    this.detail = body.detail ?? "";
    this.errors = Array.isArray(body.errors) ? body.errors : [];
  }
}

/** @param {string} path @param {RequestInit} [options] @returns {Promise<any>} */
export async function request(path, options) {
  let response;
  try {
    response = await fetch(path, options);
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Problem({ status: 0, title: "The server does not answer" });
  }
  if (response.status === 204) return null;
  const text = await response.text();
  let body;
  try {
    body = JSON.parse(text);
  } catch {
    throw new Problem({ status: response.status, title: `The server answered ${response.status}` });
  }
  if (!response.ok) throw new Problem({ title: "", ...body, status: response.status });
  return body;
}

/** @param {string} path @param {object|string} [body] a string is sent as it is */
export function post(path, body) {
  if (body === undefined) return request(path, { method: "POST" });
  const text = typeof body === "string" ? body : JSON.stringify(body);
  return request(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: text });
}

/** The path of a thing of the API with its id made safe. @param {string} kind @param {string} id @param {string} [rest] */
export const pathOf = (kind, id, rest = "") => `/v1/${kind}/${encodeURIComponent(id)}${rest}`;
