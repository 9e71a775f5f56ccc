// Conversion of writes to statements and their parameters.
#pragma once

#include "common/base/overloaded.h"
#include "server/store/records.h"
#include "server/store/row_statements.h"
#include "server/store/row_values.h"

namespace lightmill::stored {

/// Calls run(statement, parameters...) for each statement of a write, until one fails. Parameters are numbers and
/// ByteViews. `run` returns a Status. Adds new rows to `sums`. The caller counts the rows that statements return.
template <class Run>
Status write_rows(const StoreOp& op, StoredSpecs& specs, RowSums& sums, const Run& run) {
  const auto run_key = [&run](RowStatement statement, const NodeKey& key) {
    return run(statement, key.job.value, key.tile.value, key.range.level, key.range.index);
  };
  const auto run_row = [&run](RowStatement statement, const auto& row) {
    return run(statement, row.job.value, row.tile, row.level, row.index);
  };
  const auto place_of = [](const NodeKey& key) {
    return FilmPosition{key.tile.value, key.range.level, key.range.index};
  };
  const auto find_rest_of_job = [&run](std::uint64_t job) {
    LM_RETURN_IF_ERROR(run(kFindNodesOf, job));
    LM_RETURN_IF_ERROR(run(kFindResultsOf, job));
    LM_RETURN_IF_ERROR(run(kFindRecord + static_cast<int>(Table::job_specs), job));
    return run(kFindRecord + static_cast<int>(Table::job_progress), job);
  };
  const auto run_change = [&run, &sums](const RowChange& change, const auto& key) {
    const int table = static_cast<int>(change.table);
    if (!change.message) {
      return run(kDropRecord + table, key);
    }
    const std::int64_t checksum = checksum_of(change.table, change.key, *change.message);
    if (change.table != Table::actions) {  // these are never replaced
      LM_RETURN_IF_ERROR(run(kFindRecord + table, key));
      sums.count(change.table, change.key, checksum, true);
    }
    return run(kPutRecord + table, key, as_byte_view(*change.message), checksum);
  };
  return std::visit(Overloaded{[&](const PutNode& put) {
                                 const NodeKey key{put.job, put.tile, put.node->range};
                                 const std::string hash = hash_bytes(row_hash_of(put.job, put.tile, *put.node));
                                 LM_RETURN_IF_ERROR(run_key(kFindNode, key));
                                 sums.count_node(key.job, place_of(key), hash, true);
                                 return run(kPutNode, key.job.value, key.tile.value, key.range.level, key.range.index,
                                            put.node->non_finite, as_byte_view(hash), view_of(put.node->values));
                               },
                               [&](const DropNode& drop) {
                                 LM_RETURN_IF_ERROR(run_key(kFindNode, drop.key));
                                 return run_key(kDropNode, drop.key);
                               },
                               [&](const DropNodeRow& drop) {
                                 LM_RETURN_IF_ERROR(run_row(kFindNode, drop));
                                 return run_row(kDropNode, drop);
                               },
                               [&](const PutResult& put) {
                                 const std::string hash = hash_bytes(put.hash);
                                 const Audit audit = put.audit_pending ? Audit::wanted : Audit::none;
                                 const std::int64_t checksum = checksum_of(put.key, put.hash, put.by, audit);
                                 LM_RETURN_IF_ERROR(run_key(kFindResult, put.key));
                                 sums.count_result(put.key.job, place_of(put.key), checksum, true);
                                 return run(kPutResult, put.key.job.value, put.key.tile.value, put.key.range.level,
                                            put.key.range.index, as_byte_view(hash), as_byte_view(put.by.worker),
                                            as_byte_view(put.by.identity), static_cast<int>(audit),
                                            as_byte_view(put.by.fingerprint_class), checksum);
                               },
                               [&](const PutAudited& put) {
                                 LM_RETURN_IF_ERROR(run_key(kFindResult, put.key));
                                 return run_key(kPutAudited, put.key);
                               },
                               [&](const DropResults& drop) { return run_key(kDropResults, drop.key); },
                               [&](const DropResultRow& drop) { return run_row(kDropResultRow, drop); },
                               [&](const auto& write) {
                                 if constexpr (std::is_same_v<decltype(write), const DeleteJobRows&>) {
                                   LM_RETURN_IF_ERROR(find_rest_of_job(write.job.value));
                                 }
                                 for (const RowChange& change : changes_of(op, specs)) {
                                   LM_RETURN_IF_ERROR(info_of(change.table).numbered
                                                          ? run_change(change, change.key.number)
                                                          : run_change(change, as_byte_view(change.key.name)));
                                 }
                                 return ok_status();
                               }},
                    op);
}

}  // namespace lightmill::stored
