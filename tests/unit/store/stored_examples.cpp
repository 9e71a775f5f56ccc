#include "tests/unit/store/stored_examples.h"

#include "server/store/load_state.h"

namespace lightmill::test {

JobRecord full_record(std::uint64_t id) {
  JobRecord record;
  record.id = JobId{id};
  record.spec.request_id = fmt::format("request-{}", id);
  record.spec.name = "a 'quoted' näme";
  record.spec.owner = "owner";
  record.spec.host = "host.example";
  record.spec.parent = JobId{id + 100};
  record.spec.priority = -7;
  record.spec.goal = {300, 12.5, 0.0123};
  RenderSettings& settings = record.spec.settings;
  settings.scene = std::string("a\0scene\xff", 8);
  std::vector<Sha256> assets{sha256("one"), sha256("two")};
  std::ranges::sort(assets);
  settings.assets = assets;
  settings.width = 640;
  settings.height = 480;
  settings.crop = {1, 2, 30, 40};
  settings.layers = {{"beauty", 3, LayerKind::summed},
                     {"albedo", 4, LayerKind::summed},
                     {"n", 3, LayerKind::first_mean},
                     {"z", 1, LayerKind::first_nearest},
                     {"i", 1, LayerKind::first_samples}};
  settings.meters = 5;
  settings.seed = 0xfedcba9876543210u;  // over the signed range
  settings.method = "preview";
  settings.max_bounces = 0xffffffffu;
  settings.renderer_version = "core-x";
  record.method_notes = {true, {"it is the only one", "and fast"}, {"path: the lamp's caustics are missing"}, {}};
  record.spec.goal.adaptive = true;
  record.allocation = Allocation::of({-2, 0, 1, 2, 0, 0}).value();  // of one tile and five meters
  record.history = {{16, 1.5, 0.5, 0.25}, {24.5, 3, 0.25, 0.125}};
  record.state = JobState::paused;
  record.reason = "because";
  record.reached = GoalLimit::error;
  record.fingerprint_class = "class";
  record.active_seconds = 0.1;
  record.worker_seconds = 1e9 + 0.25;
  record.counters = {1, 2, 3, 4, 5, 6, 7};
  record.spec.audit_share = 0.125;
  record.spec.allow_mixed = true;
  record.submitted_unix_ms = 1'700'000'000'123;
  record.finished_unix_ms = 1'700'000'000'456;
  return record;
}

std::shared_ptr<const Node> small_node(std::uint32_t level, std::uint32_t index, float value) {
  auto node = std::make_shared<Node>();
  node->range = {level, index};
  node->values.assign(24, value);
  node->values.back() = -value / 3;
  node->non_finite = level + index;
  return node;
}

StoredState state_of_the_format_before() {
  JobRecord one = full_record(1), two = full_record(2);
  two.method_notes = {true, {"two do"}, {}, {"path", "whitted"}};
  two.spec.settings.method = "auto";
  two.history = {};
  StoredState state;
  state.next_job_id = 4;  // the third was deleted
  state.renderers = {{"worker", "machine", "class-b"}, {"worker", "machine"}, {"other", "machine"}};
  state.jobs.push_back({one,
                        {{TileId{0}, small_node(1, 0, 2.5f)}, {TileId{3}, small_node(0, 4, -1e-30f)}},
                        {{TileId{0}, {0, 0}, Hash128{3, 4}, 0},
                         {TileId{0}, {0, 1}, Hash128{1, 2}, 1, true},
                         {TileId{3}, {0, 4}, Hash128{5, 6}, 2}}});
  state.jobs.push_back({two, {}});
  state.tokens = {
      {"00112233aabb", "ada 'x' näme", {Role::view, Role::submit}, sha256("one"), "root", 1, 1'900'000'000}};
  state.actions = {
      {7, 1'700'000'000'123, "ada", Proof::certificate, "", "[::1]:4711", "CancelJob", 5, "", StatusCode::kOk, ""}};
  state.quarantine = {{{"liar", "machine"}, "wrong", 5}};
  return state;
}

Result<StoredState> load_with_films(Store& store) {
  LM_ASSIGN_OR_RETURN(StoredState state, store.load());
  std::vector<StoreOp> repairs;
  for (StoredState::StoredJob& job : state.jobs) {
    const auto read = [&](JobId id, const FilmPosition& after) { return store.read_film(id, after); };
    LM_RETURN_IF_ERROR(stored::load_values(read, job, state, repairs));
  }
  if (!repairs.empty()) {
    LM_RETURN_IF_ERROR(store.commit(repairs));
  }
  return state;
}

std::string describe(const StoredState& state) {
  std::vector<std::string> jobs;
  for (const StoredState::StoredJob& job : state.jobs) {
    const JobRecord& r = job.record;
    const RenderSettings& s = r.spec.settings;
    std::string text = fmt::format(
        "{} {} {} {} {} parent {} priority {} goal {} {} {} reached {} state {} {} class {} seconds {} {} counters {} "
        "{} {} {} {} {} {} at "
        "{} {} method {} {} {} {} ",
        r.id.value, r.spec.request_id, r.spec.name, r.spec.owner, r.spec.host, r.spec.parent.value, r.spec.priority,
        r.spec.goal.samples, r.spec.goal.seconds, r.spec.goal.error, static_cast<int>(r.reached),
        static_cast<int>(r.state), r.reason, r.fingerprint_class, r.active_seconds, r.worker_seconds,
        r.counters.results_merged, r.counters.results_duplicate, r.counters.leases_lost, r.counters.copies_leased,
        r.counters.non_finite, r.counters.results_audited, r.counters.nodes_dropped, r.submitted_unix_ms,
        r.finished_unix_ms, r.method_notes.chosen, fmt::join(r.method_notes.reasons, "|"),
        fmt::join(r.method_notes.notices, "|"), fmt::join(r.method_notes.candidates, "|"));
    for (const ErrorPoint& point : r.history) {
      text += fmt::format("error {} {} {} {} ", point.samples, point.worker_seconds, point.rel_mse, point.half_width);
    }
    text += fmt::format("adaptive {} {} ", r.spec.goal.adaptive, fmt::join(r.allocation.shifts(), ","));
    text += fmt::format("verify {} mixed {} ends with page {} ", r.spec.audit_share, r.spec.allow_mixed,
                        r.spec.ends_with_page);
    text += "digest " + render_digest(s, "").hex();  // covers every setting
    std::vector<std::string> nodes;
    for (const StoredState::StoredNode& node : job.nodes) {
      nodes.push_back(fmt::format(" tile {} {}/{} {}", node.tile.value, node.node->range.level, node.node->range.index,
                                  hash_of(*node.node).hex()));
    }
    for (const StoredState::StoredResult& result : job.results) {
      const Renderer& by = state.renderers.at(result.by);
      nodes.push_back(fmt::format(" result {} {}/{} {} {} on {} of {} {}", result.tile.value, result.range.level,
                                  result.range.index, result.hash.hex(), by.worker, by.identity, by.fingerprint_class,
                                  result.audit_pending));
    }
    std::sort(nodes.begin(), nodes.end());
    for (const std::string& node : nodes) {
      text += node;
    }
    jobs.push_back(text);
  }
  std::sort(jobs.begin(), jobs.end());
  std::string all = fmt::format("next {}\n", state.next_job_id);
  std::map<std::string, std::string> tokens;
  for (const TokenRecord& token : state.tokens) {
    tokens[token.id] =
        fmt::format("token {} {} {} {} {} {} {} enrols {} {} {} by {}\n", token.id, token.name, names_of(token.roles),
                    token.hash.hex(), token.made_by, token.made_unix_s, token.until_unix_s, token.enrolment.workers,
                    token.enrolment.enrolled, token.enrolment.worker_seconds, token.enrolled_by);
  }
  for (const auto& [id, text] : tokens) {
    all += text;
  }
  std::map<std::uint64_t, std::string> actions;
  for (const Action& action : state.actions) {
    actions[action.number] =
        fmt::format("action {} {} {} {} {} {} {} {} {} {} {} {}\n", action.number, action.unix_ms, action.caller,
                    static_cast<int>(action.proof), action.token, action.peer, action.operation, action.job,
                    action.about, static_cast<int>(action.outcome), action.message, action.change);
  }
  for (const auto& [number, text] : actions) {
    all += text;
  }
  for (const QuarantineRecord& record : state.quarantine) {
    all += fmt::format("quarantine {} {} {} {}\n", record.of.worker, record.of.identity, record.reason,
                       record.since_unix_ms);
  }
  for (const std::string& job : jobs) {
    all += job + "\n";
  }
  return all;
}

}  // namespace lightmill::test
