/** What the page's main thread did, by the browser's own tracing: processor time, which other programs do not add to. */
import type { Page } from 'playwright-core';

interface Event {
  name: string;
  pid: number;
  tid: number;
  args: { name?: string };
  /** Microseconds of processor time. */
  tdur?: number;
}

export async function startTrace(page: Page): Promise<{ end(): Promise<Event[]> }> {
  const client = await page.context().newCDPSession(page);
  const events: Event[] = [];
  client.on('Tracing.dataCollected', ({ value }) => events.push(...(value as unknown as Event[])));
  const includedCategories = ['disabled-by-default-devtools.timeline', '__metadata'];
  await client.send('Tracing.start', { transferMode: 'ReportEvents', traceConfig: { includedCategories, excludedCategories: ['*'] } });
  return {
    async end() {
      const complete = new Promise((done) => client.once('Tracing.tracingComplete', done));
      await client.send('Tracing.end');
      await complete;
      await client.detach();
      return events;
    },
  };
}

/** Milliseconds of the longest task of a page's main thread; an error where there was none. */
export function longestTask(events: Event[]): number {
  const threadOf = ({ pid, tid }: Event) => `${pid}:${tid}`;
  const main = new Set(events.filter(({ name, args }) => name === 'thread_name' && args.name === 'CrRendererMain').map(threadOf));
  const tasks = events.filter((event) => event.tdur !== undefined && event.name.endsWith('RunTask') && main.has(threadOf(event)));
  if (tasks.length === 0) throw new Error('The trace holds no task of the main thread.');
  return tasks.reduce((longest, { tdur = 0 }) => Math.max(longest, tdur / 1000), 0);
}
