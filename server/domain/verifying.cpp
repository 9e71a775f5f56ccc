// How results are verified: rendered again on another machine; and what follows where two machines differ.
#include "common/base/check.h"
#include "server/domain/coordinator_state.h"

namespace lightmill {
namespace {

/// "samples [0, 64) of the 64x64 pixels at 128, 0 of job 3".
std::string describe_place(const Job& job, TileId tile, const SampleRange& range) {
  const PixelRect rect = job.film.grid().tile_rect(tile);
  return fmt::format("samples [{}, {}) of the {}x{} pixels at {}, {} of job {}", range.first(), range.end(), rect.width,
                     rect.height, rect.x, rect.y, job.id().value);
}

std::string describe_renderers(std::span<const Claim> claims) {
  std::vector<std::string> names;
  for (const Claim& claim : claims) {
    names.push_back(describe_renderer(claim.by));
  }
  return fmt::format("{}", fmt::join(names, " and "));
}

}  // namespace

// ---- who had a part in what ----

std::uint32_t Coordinator::State::renderer_index(const Renderer& renderer) {
  const auto [at, fresh] = renderer_indices.try_emplace(renderer, static_cast<std::uint32_t>(renderers.size()));
  if (fresh) {
    renderers.push_back(renderer);
  }
  return at->second;
}

void Coordinator::State::restore_results(Job& job, const StoredState& stored,
                                         const std::vector<StoredState::StoredResult>& results) {
  for (const StoredState::StoredResult& result : results) {
    const std::vector<NodePtr>& forest = job.film.forest(result.tile);
    const auto node =
        std::ranges::find_if(forest, [&](const NodePtr& each) { return each->range.contains(result.range); });
    if (node == forest.end()) {
      orphans.push_back({job.id(), result.tile, result.range});  // its node was damaged, and is rendered again
      continue;
    }
    const Renderer& by = stored.renderers.at(result.by);
    machines_before.insert(by.machine);
    std::vector<std::uint32_t>& parts = job.parts[{result.tile, (*node)->range}];
    const std::uint32_t index = renderer_index(by);
    if (const auto at = std::ranges::lower_bound(parts, index); at == parts.end() || *at != index) {
      parts.insert(at, index);
    }
    if (result.to_verify && (job.active() || job.record.state == JobState::done)) {
      job.verifications.open({result.range, result.tile}, {by, result.hash});
    }
  }
}

/// Others may render the samples, also of another class: what was claimed of them before is not of them.
void Coordinator::State::forget_orphans(Step& step) {
  for (const NodeKey& key : std::exchange(orphans, {})) {
    step.writes.push_back(DropResults{key});
  }
}

void Coordinator::State::note_parts(Job& job, const NodeKey& key, const Renderer& by, const MergeOutcome& outcome) {
  std::vector<std::uint32_t> parts{renderer_index(by)};
  for (const SampleRange& range : outcome.removed) {
    const auto found = job.parts.find({key.tile, range});
    if (found == job.parts.end()) {
      continue;
    }
    if (!key.range.contains(range)) {  // joined, not replaced
      parts.insert(parts.end(), found->second.begin(), found->second.end());
    }
    job.parts.erase(found);
  }
  std::ranges::sort(parts);
  parts.erase(std::ranges::unique(parts).begin(), parts.end());
  for (const NodePtr& node : outcome.added) {
    job.parts[{key.tile, node->range}] = parts;
  }
}

// ---- leases ----

bool Coordinator::State::grant_verification(Worker& worker, Job& job, Time now, Step& step) {
  const Renderer by = renderer_of(worker.hello, job);
  std::vector<Verifications::Place> places = job.verifications.next_for(by, 1);
  if (places.empty()) {
    return false;
  }
  const SampleRange range = places.front().range;
  const std::uint32_t tiles = choose_tile_count(range, job.verifications.size() - job.verifications.out(),
                                                job.pixels_of(places.front().tile), aim_for(worker, job, now));
  if (tiles > 1) {
    places = job.verifications.next_for(by, tiles);
  }
  const LeaseId id = next_lease_id();
  Unit unit{job.id(), range, {}};
  for (const Verifications::Place& place : places) {
    unit.tiles.push_back(place.tile);
    job.verifications.lease(place, id);
  }
  Lease& lease = open_lease(worker, job, id, std::move(unit), false, now);
  lease.verifies = true;
  send_grant(worker, job, lease, step);
  refresh_queue(job);
  return true;
}

void Coordinator::State::end_verification_of(LeaseId id, TileId tile, Time now, Step& step) {
  const auto found = leases.find(id);
  if (found == leases.end() || !found->second.verifies) {
    return;
  }
  Job& job = *jobs.at(found->second.unit.job);
  job.verifications.release({found->second.unit.range, tile}, id, false);
  tile_done(id, tile, now, step, true);
}

std::vector<Renderer> Coordinator::State::renderers_for(const Job& job, Time now) const {
  std::set<Renderer> all;
  for (const auto& [name, worker] : workers) {
    if (worker.session && !worker.draining && may_render(worker, job) &&
        now < worker.heard_at + limits.verifier_patience) {
      all.insert({"", machine_of(worker.hello), job.class_of_result(worker.hello.fingerprint_class)});
    }
  }
  for (const auto& [machine, was] : absent) {
    if (now < was.since + limits.verifier_patience && suits(was.fingerprint_class, was.renderer_version, job) &&
        !in_quarantine({"", machine})) {
      all.insert({"", machine, job.class_of_result(was.fingerprint_class)});
    }
  }
  return {all.begin(), all.end()};
}

bool Coordinator::State::verified_as_far_as_possible(const Job& job, Time now) const {
  if (job.verifications.out() > 0 || !job.verifications.disputed().empty()) {
    return false;
  }
  if (!job.verifications.waiting()) {
    return true;
  }
  const bool others_may_come_back = machines_before.size() > 1 && now < started + limits.verifier_patience;
  return !others_may_come_back && !job.verifications.possible_for(renderers_for(job, now));
}

std::string Coordinator::State::reason_for_dispute(const Job& job) const {
  if (job.verifications.disputed().empty()) {
    return "";
  }
  const Verifications::Place& place = *job.verifications.disputed().begin();
  const Verifications::Entry& entry = *job.verifications.find(place);
  const bool third = std::ranges::any_of(workers, [&](const auto& each) {
    const Worker& worker = each.second;
    return worker.session && !worker.draining && may_render(worker, job) &&
           Verifications::may_claim(entry, renderer_of(worker.hello, job));
  });
  const std::string& of_class = entry.claims.front().by.fingerprint_class;
  return third ? ""
               : fmt::format(
                     "waits for a worker on another machine{}: {} differ between {}, so that one of them is wrong",
                     of_class.empty() ? "" : " of class " + of_class, describe_place(job, place.tile, place.range),
                     describe_renderers(entry.claims));
}

// ---- claims ----

std::optional<Claim> Coordinator::State::claim_of_film(const Job& job, const NodeKey& key, const Renderer& by) const {
  const auto found = job.parts.find({key.tile, key.range});
  const std::span<const std::uint32_t> parts =
      found == job.parts.end() ? std::span<const std::uint32_t>() : std::span(found->second);
  if (parts.empty() && job.record.spec.allow_mixed) {
    return std::nullopt;  // of which class it is, nobody knows
  }
  if (std::ranges::any_of(
          parts, [&](std::uint32_t part) { return renderers[part].fingerprint_class != by.fingerprint_class; })) {
    return std::nullopt;
  }
  const std::vector<NodePtr>& forest = job.film.forest(key.tile);
  const auto node = std::ranges::find_if(forest, [&](const NodePtr& each) { return each->range == key.range; });
  LM_CHECK(node != forest.end(), "{} is in no film", describe_place(job, key.tile, key.range));
  return Claim{parts.size() == 1 ? renderers.at(parts.front()) : Renderer{"", "", by.fingerprint_class},
               hash_of(**node)};
}

void Coordinator::State::compare_result(Job& job, const NodeKey& key, const Hash128& hash, const Renderer& by,
                                        bool differs, Time now, Step& step) {
  const Verifications::Place place{key.range, key.tile};
  const Verifications::Entry* entry = job.verifications.find(place);
  if (entry == nullptr) {
    if (!differs || job.record.spec.verify_share <= 0) {
      return;
    }
    // Nobody was to verify these samples, but a copy has: what the film holds is the first claim.
    std::optional<Claim> first = claim_of_film(job, key, by);
    if (!first) {
      return;
    }
    job.verifications.open(place, *std::move(first), false);
  } else if (!Verifications::may_claim(*entry, by)) {
    return;  // a machine is heard once, and one of another class not at all
  }
  const Verdict verdict = job.verifications.claim(place, {by, hash});
  if (verdict.kind == Verdict::Kind::agreed) {
    settle_verification(job, key, verdict.hash, now, step);
  } else if (verdict.kind == Verdict::Kind::program) {
    accuse_program(job, key, now, step);
  } else {
    note(step, Note::Level::warning, about(job.id()), "{} differ between {}: another machine is to decide",
         describe_place(job, key.tile, key.range), describe_renderers(job.verifications.find(place)->claims));
  }
}

void Coordinator::State::settle_verification(Job& job, const NodeKey& key, const Hash128& hash, Time now, Step& step) {
  const Verifications::Place place{key.range, key.tile};
  const Verifications::Entry entry = *job.verifications.find(place);
  if (const std::optional<LeaseId> lease = job.verifications.close(place)) {
    tile_done(*lease, key.tile, now, step, false);
  }
  std::vector<Claim> agreed, wrong;
  for (const Claim& claim : entry.claims) {
    (claim.hash == hash ? agreed : wrong).push_back(claim);
  }
  if (entry.chosen && entry.claims.front().hash == hash) {  // else it may be no single result
    ++job.record.counters.results_verified;
    ++totals.results_verified;
    step.writes.push_back(PutVerified{key});
  }
  for (const Claim& claim : wrong) {
    if (claim.by.worker.empty()) {
      note(step, Note::Level::warning, about(job.id()),
           "{}: what several workers' results were joined to is wrong; it is rendered again",
           describe_place(job, key.tile, key.range));
      drop_node_with(job, key.tile, key.range, now, step);
    } else {
      convict(claim.by, job, key, agreed, now, step);
    }
  }
}

void Coordinator::State::accuse_program(Job& job, const NodeKey& key, Time now, Step& step) {
  const std::vector<Claim> claims = job.verifications.find({key.range, key.tile})->claims;
  job.record.reason = fmt::format(
      "{} came out in {} ways, on {}: that is the program's fault, not a worker's; please report it. Resumed, the job "
      "renders them again",
      describe_place(job, key.tile, key.range), claims.size(), describe_renderers(claims));
  drop_node_with(job, key.tile, key.range, now, step);
  job.record.state = JobState::paused;
  put_job(job, step);
  refresh_queue(job);
  note(step, Note::Level::warning, about(job.id()), "job {} is paused: {}", job.id().value, job.record.reason);
}

void Coordinator::State::convict(const Renderer& guilty, const Job& job, const NodeKey& key,
                                 std::span<const Claim> agreed, Time now, Step& step) {
  ++totals.results_wrong;
  put_in_quarantine(guilty,
                    fmt::format("its {} differ from what {} have rendered alike",
                                describe_place(job, key.tile, key.range), describe_renderers(agreed)),
                    now, step);
  undo_work_of(guilty, now, step);
}

}  // namespace lightmill
