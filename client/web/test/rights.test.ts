import {expect, test} from 'vitest';
import {refusalOf, type Rights} from '../src/model/rights';

const submitter: Rights = {caller: 'ada', roles: ['submit'], may: ['SubmitJob'], mayWithOwn: ['SubmitJob', 'PauseJob']};

test('an operation is allowed if the coordinator lists it for any job, or for own jobs', () => {
  expect(refusalOf(submitter, 'SubmitJob')).toBeUndefined();
  expect(refusalOf(submitter, 'PauseJob', 'ada')).toBeUndefined();
  expect(refusalOf(submitter, 'PauseJob', 'bob')).toMatch(/another user.*submit/);
  expect(refusalOf(submitter, 'DrainWorker')).toMatch(/Your roles \(submit\)/);
});

test('a caller without a name does not own a job without an owner', () => {
  expect(refusalOf({...submitter, caller: ''}, 'PauseJob', '')).toBeDefined();
});

test('nothing is refused before the rights are known', () => {
  expect(refusalOf(undefined, 'PauseJob', 'bob')).toBeUndefined();
});
