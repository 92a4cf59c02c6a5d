/** What WCAG 2.2 AA asks for and axe can see. */
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { expect } from 'vitest';
import type { Page } from 'playwright-core';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');

export async function expectAccessible(page: Page, state: string): Promise<void> {
  const axe = await readFile(AXE, 'utf8');
  // A colour on its way from one theme to the other is no state.
  await page.evaluate(async () => void (await Promise.allSettled(document.getAnimations().map(({ finished }) => finished))));
  // As an expression of the debugger, which the page's own policy does not bind.
  await page.evaluate(`${axe}; 0`);
  const violations = await page.evaluate(async () => {
    interface Axe { run(where: Document, options: object): Promise<{ violations: { id: string; nodes: { html: string }[] }[] }> }
    const { axe } = window as unknown as { axe: Axe };
    const { violations } = await axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'] });
    return violations.map(({ id, nodes }) => ({ id, where: nodes.map(({ html }) => html.slice(0, 120)) }));
  });
  expect(violations, state).toEqual([]);
}
