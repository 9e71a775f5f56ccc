// What can happen to a simulated farm, which bugs can be planted into it, and what it reports.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/farm/job.h"

namespace lightmill::simulation {

/// What one machine does to a farm on purpose.
enum class Attack { wrong_sums, some_wrong_sums, two_names, claims, ungranted, garbage, idle, spite };

/// What happens to the farm while chaos lasts.
struct Chaos {
  bool deaths = true;       ///< workers are killed, and come back under the same or another name
  bool hangs = true;        ///< workers stop for a while
  bool breaks = true;       ///< streams break; either end may notice late
  bool repeats = true;      ///< messages come twice
  bool restarts = true;     ///< the coordinator is killed and started again
  bool changes = true;      ///< clients extend, pause, resume, cancel, delete; drain workers
  bool copies = true;       ///< idle workers get copies
  bool poison = true;       ///< some jobs have a sample, or a pilot, that kills whoever renders it
  bool verifies = true;     ///< some jobs have results verified, some or all
  bool liars = true;        ///< some farms have a machine that lies, or sends garbage
  bool idle = true;         ///< some farms have a worker that is heard, takes work and delivers nothing
  bool small = true;        ///< some workers find some jobs too large for them
  bool cuts = true;         ///< links carry nothing in one direction for a while
  bool slow = true;         ///< workers are a hundred times slower for a while
  bool disks = true;        ///< the disk is full or slow for a while
  bool damage = true;       ///< a crash damages a node that was stored
  bool refusals = true;     ///< some jobs cannot be rendered, and liars refuse what can be
  bool memory = true;       ///< workers run out of it while they prepare or render, and are started again
  bool inspections = true;  ///< clients have scene files read
  bool deposes = true;      ///< the coordinator stands still, another takes over, and the first goes on
  bool films = true;        ///< films of ended jobs leave memory soon, and clients look at films
  std::optional<Attack> attack = std::nullopt;  ///< instead of the liars that are drawn
  static Chaos none() {
    return {false, false, false, false, false, false, false, false, false, false, false,
            false, false, false, false, false, false, false, false, false, false};
  }
};

/// Bugs planted around the parts that are tested: each must be found.
struct PlantedBugs {
  bool acknowledge_before_commit = false;  ///< missed flush
  bool never_requeue = false;              ///< lost requeue: no lease ever expires
  bool merge_twice = false;                ///< a repeated result enters the film as other samples
  bool keep_joined_nodes = false;          ///< nodes that were joined stay on disk
  bool lose_a_write = false;               ///< now and then a node does not reach the disk
  bool torn_commits = false;               ///< a crash leaves half a transaction
  bool lease_before_commit = false;        ///< leases leave before the job's class is stored
  bool wrong_bits = false;                 ///< one worker's sums differ in the last bit
  bool lose_acknowledgements = false;      ///< acknowledgements do not leave
  bool forget_jobs = false;                ///< a restarted coordinator does not know the newest job
  bool repeat_results = false;             ///< who verifies sends what came first, not what it has rendered
  bool forget_quarantine = false;          ///< a restarted coordinator knows of no quarantine
  bool keep_dropped_results = false;       ///< who rendered what was dropped stays on disk
  bool lose_verifications = false;         ///< what is to be verified does not reach the disk
  bool ignore_identities = false;          ///< each worker counts as an identity of its own
  bool wait_for_the_idle = false;          ///< workers may hold work as long as they are heard
  bool ignore_grants = false;              ///< what was never granted is taken
  bool lose_what_is_cut = false;           ///< what is sent while a link is cut is lost, and the stream goes on
  bool disconnect_newcomers = false;       ///< that a stream has broken is taken to mean its worker's newest one
  bool trust_hashes = false;               ///< what came damaged is taken for whole
  bool drop_when_full = false;             ///< what a full disk refuses counts as stored
  bool hide_damage = false;                ///< damaged nodes are loaded as if they were whole
  bool no_epochs = false;                  ///< a deposed coordinator may write
  bool lose_films = false;                 ///< films that are to be read do not come
  bool lose_reports = false;               ///< what was found in scene files is not told
  bool hide_classes = false;               ///< workers of the other class say that they are of the usual one
  bool blame_hastily = false;              ///< the first loss of a worker condemns what it rendered
  bool believe_one_refusal = false;        ///< one identity's refusal fails a job
  bool blame_unsent = false;               ///< leases run from when they are granted, sent or not
  bool blame_early = false;                ///< a job fails one lost worker too early
  bool expire_early = false;               ///< leases expire between two heartbeats
  bool end_early = false;                  ///< a job's seconds are taken for half as many
  bool end_late = false;                   ///< a job's seconds are taken for twice as many
};

struct Report {
  std::string failure;                          ///< empty: all is well
  std::map<std::string, std::uint64_t> faults;  ///< what has befallen the farm, and how often
  std::uint64_t wanted = 0;                     ///< pixel samples of all jobs that are done
  std::uint64_t rendered = 0;                   ///< pixel samples that workers rendered
  std::uint64_t lost_with_workers =
      0;  ///< pixel samples that dead workers had rendered or were rendering, unacknowledged
  std::uint64_t results_duplicate = 0;
  std::uint64_t events = 0;
  std::uint64_t inspections = 0, inspected = 0;  ///< asked for, and answered with what was found
  std::uint64_t restarts = 0;
  std::uint64_t deaths = 0;
  std::uint64_t poisoned = 0;    ///< jobs that killed too many workers in a row, and failed
  std::uint64_t unlucky = 0;     ///< jobs that kill nobody, and failed because bad luck took as many with them
  std::uint64_t verified = 0;    ///< pixel samples that were rendered again with the same bits
  std::uint64_t unverified = 0;  ///< results of done jobs that could not be verified
  std::uint64_t refused = 0;     ///< jobs that cannot be rendered, and failed
  std::uint64_t spited = 0;      ///< jobs that failed by one liar's word, while nobody else was there
  std::uint64_t too_large = 0;   ///< times that a worker left a job to others
  std::uint64_t convicted = 0;   ///< times that somebody was put into quarantine
  std::uint64_t mixed = 0;       ///< jobs whose films have results of two classes
  bool lied = false;             ///< a worker has sent wrong sums
  double job_seconds = 0;        ///< of a race: from its job's submission until it is done
  double last_part_seconds = 0;  ///< of a race: from 95 % of the job's pixel samples until it is done
  Hash128 effects;               ///< after hash_effects(): of all effects and views, in order
};

/// Instead of chaos: one job on workers that are not equally fast, whose end is timed.
struct Race {
  std::vector<double> slowness = {1, 1, 1, 1};  ///< a worker each
  std::uint32_t threads = 2;                    ///< of each worker
  std::uint64_t samples = 64;                   ///< a pixel, of 128 tiles
  double tile_seconds = 0.03;                   ///< of one sample of a tile, on one thread of a worker of slowness 1
  double verify_share = kVerifyShare;           ///< of the results
  double change_after = 0;                      ///< seconds from the submission until something befalls the last worker
  double slowness_then = 0;                     ///< from then on it is so slow; 0: as before
  bool hangs_then = false;                      ///< from then on it does nothing any more
};

}  // namespace lightmill::simulation
