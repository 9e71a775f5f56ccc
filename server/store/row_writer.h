// Conversion of writes to statements and their parameters. Each database has its own SQL for the statements.
#pragma once

#include "common/base/overloaded.h"
#include "server/store/records.h"
#include "server/store/row_values.h"

namespace lightmill::stored {

enum RowStatement : int {
  kPutNode,        ///< job, tile, level, range_index, non_finite, hash, samples
  kDropNode,       ///< job, tile, level, range_index
  kPutResult,      ///< the columns of `results`
  kPutAudited,     ///< job, tile, level, range_index
  kDropResults,    ///< the same: all results whose samples lie in this range
  kDropResultRow,  ///< job, tile, level, range_index
  kPutRecord,      ///< the first of one per table (Table): key, message, checksum
  kDropRecord = kPutRecord + static_cast<int>(kTableCount),  ///< the first of one per table: key
  kRowStatementCount = kDropRecord + static_cast<int>(kTableCount)
};

/// Calls run(statement, parameters...) for each statement of a write, until one fails. Parameters are numbers and
/// ByteViews. `run` returns a Status.
template <class Run>
Status write_rows(const StoreOp& op, StoredSpecs& specs, RowKeys& keys, const Run& run) {
  const auto run_key = [&run](RowStatement statement, const NodeKey& key) {
    return run(statement, key.job.value, key.tile.value, key.range.level, key.range.index);
  };
  const auto run_change = [&run](const RowChange& change, const auto& key) {
    const int table = static_cast<int>(change.table);
    return change.message ? run(kPutRecord + table, key, as_byte_view(*change.message),
                                checksum_of(change.table, change.key, *change.message))
                          : run(kDropRecord + table, key);
  };
  return std::visit(
      Overloaded{[&](const PutNode& put) {
                   const SampleRange& range = put.node->range;
                   const std::string hash = hash_bytes(row_hash_of(put.job, put.tile, *put.node));
                   return run(kPutNode, put.job.value, put.tile.value, range.level, range.index, put.node->non_finite,
                              as_byte_view(hash), view_of(put.node->values));
                 },
                 [&](const DropNode& drop) { return run_key(kDropNode, drop.key); },
                 [&](const PutResult& put) {
                   const std::string hash = hash_bytes(put.hash);
                   const Audit audit = put.audit_pending ? Audit::wanted : Audit::none;
                   return run(kPutResult, put.key.job.value, put.key.tile.value, put.key.range.level,
                              put.key.range.index, as_byte_view(hash), as_byte_view(put.by.worker),
                              as_byte_view(put.by.identity), static_cast<int>(audit),
                              as_byte_view(put.by.fingerprint_class), checksum_of(put.key, put.hash, put.by, audit));
                 },
                 [&](const PutAudited& put) { return run_key(kPutAudited, put.key); },
                 [&](const DropResults& drop) { return run_key(kDropResults, drop.key); },
                 [&](const DropResultRow& drop) {
                   return run(kDropResultRow, drop.job.value, drop.tile, drop.level, drop.index);
                 },
                 [&](const auto&) {
                   for (const RowChange& change : changes_of(op, specs)) {
                     change.message ? keys.put(change.table, change.key) : keys.drop(change.table, change.key);
                     LM_RETURN_IF_ERROR(info_of(change.table).numbered
                                            ? run_change(change, change.key.number)
                                            : run_change(change, as_byte_view(change.key.name)));
                   }
                   return ok_status();
                 }},
      op);
}

}  // namespace lightmill::stored
