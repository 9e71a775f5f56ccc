// Sample ranges, units, and leases of units.
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/limits.h"
#include "lightmill/v1/worker_service.pb.h"

namespace lightmill {
namespace {

void to_wire(const std::vector<Sha256>& tags, google::protobuf::RepeatedPtrField<std::string>* out) {
  for (const Sha256& tag : tags) {
    *out->Add() = digest_bytes(tag);
  }
}

Result<std::vector<Sha256>> tags_from_wire(const google::protobuf::RepeatedPtrField<std::string>& tags,
                                           const Unit& unit) {
  if (static_cast<std::size_t>(tags.size()) != unit.tiles.size()) {
    return invalid_argument("tags: one per tile is expected, got {} for {} tiles", tags.size(), unit.tiles.size());
  }
  std::vector<Sha256> out;
  out.reserve(unit.tiles.size());
  for (const std::string& tag : tags) {
    LM_ASSIGN_OR_RETURN(out.emplace_back(), digest_from_bytes(tag));
  }
  return out;
}

}  // namespace

void to_wire(const SampleRange& range, v1::SampleRange* out) {
  out->set_level(range.level);
  out->set_index(range.index);
}

Result<SampleRange> from_wire(const v1::SampleRange& range) {
  if (range.level() > kMaxRangeLevel) {
    return invalid_argument("range.level: must be at most {}, got {}", kMaxRangeLevel, range.level());
  }
  const SampleRange out{range.level(), range.index()};
  if (out.end() > kMaxSamples) {
    return invalid_argument("range.index: {} at level {} is beyond sample {}", range.index(), range.level(),
                            kMaxSamples);
  }
  return out;
}

void to_wire(const NodeKey& key, v1::NodeKey* out) {
  out->set_job(key.job.value);
  out->set_tile(key.tile.value);
  to_wire(key.range, out->mutable_range());
}

Result<NodeKey> from_wire(const v1::NodeKey& key) {
  LM_ASSIGN_OR_RETURN(const SampleRange range, from_wire(key.range()));
  return NodeKey{JobId{key.job()}, TileId{key.tile()}, range};
}

void to_wire(const Unit& unit, v1::Unit* out) {
  out->set_job(unit.job.value);
  to_wire(unit.range, out->mutable_range());
  out->mutable_tiles()->Reserve(static_cast<int>(unit.tiles.size()));
  for (const TileId tile : unit.tiles) {
    out->add_tiles(tile.value);
  }
}

Result<Unit> from_wire(const v1::Unit& unit) {
  LM_RETURN_IF_ERROR(check_count("unit.tiles", unit.tiles_size(), kMaxUnitTiles));
  Unit out;
  out.job = JobId{unit.job()};
  LM_ASSIGN_OR_RETURN(out.range, from_wire(unit.range()));
  out.tiles.reserve(unit.tiles_size());
  for (const std::uint32_t tile : unit.tiles()) {
    out.tiles.push_back(TileId{tile});
  }
  return out;
}

void to_wire(const HeldLease& held, v1::HeldLease* out) {
  out->set_lease(held.lease.value);
  out->set_epoch(held.epoch);
  out->set_render_digest(digest_bytes(held.render_digest));
  to_wire(held.unit, out->mutable_unit());
  to_wire(held.tags, out->mutable_tags());
}

Result<HeldLease> from_wire(const v1::HeldLease& held) {
  LM_ASSIGN_OR_RETURN(Unit unit, from_wire(held.unit()));
  LM_ASSIGN_OR_RETURN(const Sha256 digest, digest_from_bytes(held.render_digest()));
  LM_ASSIGN_OR_RETURN(std::vector<Sha256> tags, tags_from_wire(held.tags(), unit));
  return HeldLease{LeaseId{held.lease()}, held.epoch(), digest, std::move(unit), std::move(tags)};
}

void to_wire(const LeaseGrant& grant, v1::LeaseGrant* out) {
  out->set_lease(grant.lease.value);
  to_wire(grant.unit, out->mutable_unit());
  out->set_trace_id(hash_bytes(grant.trace));
  to_wire(grant.tags, out->mutable_tags());
}

Result<LeaseGrant> from_wire(const v1::LeaseGrant& grant) {
  LM_ASSIGN_OR_RETURN(Unit unit, from_wire(grant.unit()));
  LM_ASSIGN_OR_RETURN(const Hash128 trace, trace_from_bytes(grant.trace_id()));
  LM_ASSIGN_OR_RETURN(std::vector<Sha256> tags, tags_from_wire(grant.tags(), unit));
  return LeaseGrant{LeaseId{grant.lease()}, std::move(unit), trace, std::move(tags)};
}

}  // namespace lightmill
