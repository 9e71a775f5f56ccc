// Faults of a simulated farm, bugs to plant into it, and its report.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/farm/job.h"

namespace lightmill::simulation {

/// Attack of one machine on a farm, or of two.
enum class Attack {
  wrong_sums,
  some_wrong_sums,
  two_names,
  two_identities,
  claims,
  ungranted,
  garbage,
  idle,
  spite,
  losses,
  second_identity
};

/// Faults of the farm while chaos lasts.
struct Chaos {
  bool deaths = true;       ///< workers are killed, and come back under the same or another name
  bool hangs = true;        ///< workers stop for a while
  bool breaks = true;       ///< streams break, and either end may notice late
  bool repeats = true;      ///< messages come twice
  bool restarts = true;     ///< the coordinator is killed and started again
  bool changes = true;      ///< clients extend, pause, resume, cancel, delete; drain workers
  bool copies = true;       ///< idle workers get copies
  bool poison = true;       ///< some jobs have a sample or a pilot that kills its worker
  bool audits = true;       ///< some jobs have some or all results audited
  bool liars = true;        ///< some farms have a machine that lies or sends garbage
  bool idle = true;         ///< some farms have a worker that takes work and delivers nothing
  bool small = true;        ///< some jobs are too large for some workers
  bool cuts = true;         ///< links carry nothing in one direction for a while
  bool slow = true;         ///< workers are a hundred times slower for a while
  bool disks = true;        ///< the disk is full or slow for a while
  bool damage = true;       ///< a crash damages a node that was stored
  bool refusals = true;     ///< some jobs cannot be rendered, and liars refuse others
  bool memory = true;       ///< workers run out of memory while they prepare or render, and restart
  bool inspections = true;  ///< clients ask for scene files to be read
  bool deposes = true;      ///< the coordinator stands still, another takes over, and the first resumes
  bool films = true;        ///< films of ended jobs leave memory soon, and clients use films
  std::optional<Attack> attack = std::nullopt;  ///< instead of drawn liars
  static Chaos none() {
    return {false, false, false, false, false, false, false, false, false, false, false,
            false, false, false, false, false, false, false, false, false, false};
  }
};

/// Bugs planted around the tested parts. The checks must find each of them.
struct PlantedBugs {
  bool acknowledge_before_commit = false;  ///< missed flush
  bool never_requeue = false;              ///< lost requeue: no lease ever expires
  bool merge_twice = false;                ///< a repeated result enters the film as other samples
  bool keep_joined_nodes = false;          ///< joined nodes stay on disk
  bool lose_a_write = false;               ///< now and then a node does not reach the disk
  bool torn_commits = false;               ///< a crash leaves half a transaction
  bool lease_before_commit = false;        ///< leases are sent before the job's class is stored
  bool wrong_bits = false;                 ///< one worker's sums differ in the last bit
  bool lose_acknowledgements = false;      ///< acknowledgements are not sent
  bool forget_jobs = false;                ///< a restarted coordinator does not know the newest job
  bool repeat_results = false;             ///< an auditor sends the first result, not its own
  bool repeat_after_quarantine = false;    ///< the same, once a liar was found
  bool repeat_after_agreement = false;     ///< the same, once two identities have sent the same wrong result
  bool wrong_beside_lies = false;          ///< results beside an unaudited one of a liar differ in the last bit
  bool forget_quarantine = false;          ///< a restarted coordinator has no quarantine
  bool keep_dropped_results = false;       ///< records of dropped results stay on disk
  bool lose_audits = false;                ///< pending audits do not reach the disk
  bool ignore_identities = false;          ///< each worker counts as an identity of its own
  bool trust_claims = false;               ///< claimed machines count as identities, not certificates
  bool wait_for_the_idle = false;          ///< workers may keep leases as long as they send heartbeats
  bool ignore_grants = false;              ///< results that were never granted are taken
  bool lose_what_is_cut = false;           ///< messages during a cut link are lost, and the stream continues
  bool disconnect_newest = false;          ///< a broken stream is taken for its worker's newest one
  bool trust_hashes = false;               ///< damaged results are taken
  bool drop_when_full = false;             ///< writes that a full disk refuses count as stored
  bool hide_damage = false;                ///< damaged nodes are loaded as if they were whole
  bool no_epochs = false;                  ///< a deposed coordinator may write
  bool lose_films = false;                 ///< requested films are never read
  bool lose_reports = false;               ///< reports of inspections are lost
  bool hide_classes = false;               ///< workers of the other class claim the usual one
  bool blame_hastily = false;              ///< the first loss of a worker fails its job
  bool believe_one_refusal = false;        ///< one identity's refusal fails a job
  bool blame_unsent = false;               ///< leases start when they are granted, sent or not
  bool blame_early = false;                ///< a job fails one lost worker too early
  bool expire_early = false;               ///< leases expire between two heartbeats
  bool end_early = false;                  ///< a job's time limit is halved
  bool end_late = false;                   ///< a job's time limit is doubled
  bool audit_less = false;                 ///< half of a job's share is audited
  bool show_unstored_ends = false;         ///< clients see the end of a job before it is stored
};

struct Report {
  std::string failure;                          ///< empty: no failure
  std::map<std::string, std::uint64_t> faults;  ///< count of each fault
  std::uint64_t wanted = 0;                     ///< pixel samples of all done jobs
  std::uint64_t rendered = 0;                   ///< pixel samples that workers rendered
  std::uint64_t lost_with_workers = 0;          ///< unacknowledged pixel samples of dead workers
  std::uint64_t results_duplicate = 0;
  std::uint64_t events = 0;
  std::uint64_t inspections = 0, inspected = 0;  ///< requests, and answers with a finding
  std::uint64_t restarts = 0;
  std::uint64_t deaths = 0;
  std::uint64_t poisoned = 0;        ///< jobs that killed too many workers in a row and failed
  std::uint64_t unlucky = 0;         ///< harmless jobs that failed because enough workers were lost by chance
  std::uint64_t audited = 0;         ///< pixel samples that audits confirmed
  std::uint64_t unaudited = 0;       ///< unaudited results of done jobs
  std::uint64_t refused = 0;         ///< jobs that cannot be rendered and failed
  std::uint64_t failed_by_liar = 0;  ///< jobs that failed by one liar's refusal while no other worker was connected
  std::uint64_t too_large = 0;       ///< count of refusals for a worker's own limits
  std::uint64_t quarantined = 0;     ///< count of entries into quarantine
  std::uint64_t mixed = 0;           ///< jobs whose films have results of two classes
  bool lied = false;                 ///< a worker has sent wrong sums
  double deceit_parts = 0;           ///< of a race with a deceit: parts of its results in the film
  double job_seconds = 0;            ///< of a race: from its job's submission to its end
  double last_part_seconds = 0;      ///< of a race: from 95 % of the job's pixel samples to its end
  Hash128 effects;                   ///< after hash_effects(): hash of all effects and views, in order
};

/// Deceit: the first workers of a race falsify some of their results. They share one identity, and their wrong bits are
/// equal.
struct Deceit {
  std::size_t liars = 1;
  double least_parts = 1, most_parts = 1;  ///< of a result of the deceit, in parts of the job (kPartsOfAJob)
  double parts = 1;                        ///< of all its results together
  double wrong = 1;                        ///< probability that a result of the deceit is wrong
  bool new_names = false;                  ///< liars leave and come back with other names and machines
  bool know_audits = true;                 ///< they render audits honestly; no real worker knows them
};

/// Race: instead of chaos, one job on workers of different speed, whose end is timed.
struct Race {
  std::vector<double> slowness = {1, 1, 1, 1};  ///< one value per worker
  std::uint32_t threads = 2;                    ///< of each worker
  std::uint64_t samples = 64;                   ///< per pixel, of 128 tiles
  double tile_seconds = 0.03;        ///< for one sample per pixel of a tile, on one thread of a worker of slowness 1
  double audit_share = kAuditShare;  ///< share of the results that are audited
  double change_after = 0;           ///< seconds from the submission until the last worker changes
  double slowness_then = 0;          ///< its slowness from then on; 0: unchanged
  bool hangs_then = false;           ///< from then on it does nothing
  std::optional<Deceit> deceit = std::nullopt;  ///< the race ends when it is found, or with the job; no copies
};

}  // namespace lightmill::simulation
