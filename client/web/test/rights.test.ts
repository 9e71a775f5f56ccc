import {expect, test} from 'vitest';
import {refusalOf, type Rights} from '../src/model/rights';

const submitter: Rights = {caller: 'ada', roles: ['submit'], may: ['SubmitJob'], mayWithOwn: ['SubmitJob', 'PauseJob']};

test('what the coordinator has named may be done, with anybody’s job or with one’s own', () => {
  expect(refusalOf(submitter, 'SubmitJob')).toBeUndefined();
  expect(refusalOf(submitter, 'PauseJob', 'ada')).toBeUndefined();
  expect(refusalOf(submitter, 'PauseJob', 'bob')).toMatch(/another user.*submit/);
  expect(refusalOf(submitter, 'DrainWorker')).toMatch(/Your roles \(submit\)/);
});

test('a job of nobody is not that of a caller without a name', () => {
  expect(refusalOf({...submitter, caller: ''}, 'PauseJob', '')).toBeDefined();
});

test('nothing is refused before anything is known', () => {
  expect(refusalOf(undefined, 'PauseJob', 'bob')).toBeUndefined();
});
