#include "server/store/postgres/session.h"

#include <libpq-fe.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "common/base/log.h"
#include "common/base/text.h"

namespace lightmill::postgres {
namespace {

/// A batch buffers at most this, plus one statement, before it is sent.
constexpr std::size_t kMaxUnsentBytes = std::size_t{1} << 20;

/// Finds dead peers within seconds, and refuses read-only servers. The URL may set other values.
constexpr std::array<std::pair<const char*, const char*>, 9> kDefaults{{{"connect_timeout", "5"},
                                                                        {"keepalives", "1"},
                                                                        {"keepalives_idle", "5"},
                                                                        {"keepalives_interval", "2"},
                                                                        {"keepalives_count", "3"},
                                                                        {"tcp_user_timeout", "15000"},
                                                                        {"target_session_attrs", "read-write"},
                                                                        {"dbname", nullptr},
                                                                        {"application_name", nullptr}}};

/// A commit must be durable when it returns, whatever the database's default is. A coordinator that is stopped in a
/// transaction must not keep its locks. Compiling a query (JIT) takes longer than any of ours.
constexpr const char* kSettings = R"sql(
SET client_min_messages = warning;
SET client_encoding = 'UTF8';
SET search_path = lightmill;
SET default_transaction_isolation = 'read committed';
SET statement_timeout = 0;
SET lock_timeout = 0;
SET idle_in_transaction_session_timeout = '30s';
SET bytea_output = 'hex';
SET jit = off;
SELECT set_config('synchronous_commit', 'on', false) WHERE current_setting('synchronous_commit') = 'off';
)sql";

StatusCode code_of(std::string_view state) {
  const std::string_view family = state.substr(0, 2);
  if (state == kDeposed) {
    return StatusCode::kFailedPrecondition;
  }
  if (state == kStoredAlready) {
    return StatusCode::kAlreadyExists;
  }
  if (state == "42501") {
    return StatusCode::kPermissionDenied;
  }
  if (state == "23505") {
    return StatusCode::kAlreadyExists;
  }
  if (state == "53300" || family == "08" || family == "57" || family == "40" || family == "58" || state == "55P03" ||
      state == "25006" || state == "25P03") {
    return StatusCode::kUnavailable;  // too many clients, connection, shutdown, deadlock, failing I/O, read-only
  }
  if (family == "53") {
    return StatusCode::kResourceExhausted;
  }
  return family == "XX" && state != "XX000" ? StatusCode::kDataLoss : StatusCode::kInternal;
}

}  // namespace

Result<std::string> Target::describe() const {
  char* problem = nullptr;
  PQconninfoOption* options = PQconninfoParse(url.c_str(), &problem);
  if (options == nullptr) {
    Status status = invalid_argument("not the URL of a PostgreSQL database (postgres://USER@HOST/DATABASE): {}",
                                     library_text(problem != nullptr ? problem : "out of memory"));
    PQfreemem(problem);
    return status;
  }
  std::string host = "this machine", port = "5432", database;
  for (const PQconninfoOption* option = options; option->keyword != nullptr; ++option) {
    if (option->val == nullptr || *option->val == '\0') {
      continue;
    }
    const std::string_view keyword = option->keyword;
    if (keyword == "host") {
      host = option->val;
    } else if (keyword == "port") {
      port = option->val;
    } else if (keyword == "dbname") {
      database = option->val;
    }
  }
  PQconninfoFree(options);
  return fmt::format("PostgreSQL at {}:{}{}", host, port, database.empty() ? "" : ", database " + database);
}

// ---- the connection ----

Session::Session(Target target, std::span<const char* const> statements, std::chrono::milliseconds timeout)
    : target_(std::move(target)), statements_(statements), timeout_(timeout) {
  const Result<std::string> place = target_.describe();
  place_ = place.ok() ? *place : "PostgreSQL";
}

Session::~Session() {
  close();
}

void Session::close() {
  PQfinish(std::exchange(connection_, nullptr));
}

Status Session::connect() {
  if (connection_ != nullptr && PQstatus(connection_) == CONNECTION_OK) {
    return ok_status();
  }
  close();
  std::vector<const char*> names, values;
  for (const auto& [name, value] : kDefaults) {
    names.push_back(name);
    values.push_back(value != nullptr                     ? value
                     : std::string_view(name) == "dbname" ? target_.url.c_str()
                                                          : target_.application.c_str());
  }
  names.push_back(nullptr);
  values.push_back(nullptr);
  connection_ = PQconnectdbParams(names.data(), values.data(), 1);
  if (connection_ == nullptr || PQstatus(connection_) != CONNECTION_OK) {
    return lost("cannot connect (does it run there, and do user and database of --store exist?)");
  }
  if (PQsetnonblocking(connection_, 1) != 0) {
    return lost("cannot connect");
  }
  PQsetNoticeProcessor(
      connection_, [](void*, const char* notice) { spdlog::debug("PostgreSQL: {}", library_text(notice)); }, nullptr);
  if (const Status status = set_up(); !status.ok()) {
    close();
    return status;
  }
  return ok_status();
}

Status Session::set_up() {
  LM_RETURN_IF_ERROR(execute(kSettings));
  LM_ASSIGN_OR_RETURN(const Rows rows, query("SELECT current_setting('server_encoding')"));
  if (rows.view(0, 0) != "UTF8") {
    return failed_precondition("{}: the database's encoding is {}. Create it with ENCODING 'UTF8'", place_,
                               rows.view(0, 0));
  }
  return prepare_all();
}

Status Session::prepare_all() {
  if (statements_.empty()) {
    return ok_status();
  }
  LM_RETURN_IF_ERROR(begin_batch());
  for (std::size_t i = 0; i < statements_.size() && batch_failure_.ok(); ++i) {
    if (PQsendPrepare(connection_, std::to_string(i).c_str(), statements_[i], 0, nullptr) == 0) {
      batch_failure_ = lost("cannot send");
    }
  }
  return finish_batch();
}

/// Closes the connection, which cannot be used any more.
Status Session::lost(std::string_view what) {
  std::string reason = connection_ != nullptr ? library_text(PQerrorMessage(connection_)) : "out of memory";
  if (!reason.empty()) {
    reason.insert(0, ": ");
  }
  close();
  last_state_.clear();
  return unavailable("{}: {}{}", place_, what, reason);
}

Status Session::failure_of(const PGresult* result) {
  const char* state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  last_state_ = state != nullptr ? state : "";
  if (last_state_.empty()) {  // an error of libpq itself: the connection broke
    return lost("the connection is lost");
  }
  const char* message = PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY);
  const char* detail = PQresultErrorField(result, PG_DIAG_MESSAGE_DETAIL);
  return make_error(code_of(last_state_), "{}: {}{} (SQLSTATE {})", place_, message != nullptr ? message : "failed",
                    detail != nullptr ? fmt::format(": {}", library_text(detail)) : "", last_state_);
}

Status Session::flush() {
  for (;;) {
    const int left = PQflush(connection_);
    if (left == 0) {
      unsent_bytes_ = 0;
      return ok_status();
    }
    if (left < 0) {
      return lost("the connection is lost");
    }
    pollfd socket{PQsocket(connection_), POLLIN | POLLOUT, 0};
    const int ready = ::poll(&socket, 1, static_cast<int>(timeout_.count()));
    if (ready < 0 && errno == EINTR) {
      continue;
    }
    if (ready <= 0) {
      return lost(fmt::format("has accepted no data for {} s", timeout_.count() / 1000));
    }
    if ((socket.revents & ~POLLOUT) != 0 && PQconsumeInput(connection_) == 0) {
      return lost("the connection is lost");
    }
  }
}

Result<PGresult*> Session::next_result() {
  while (PQisBusy(connection_) != 0) {
    pollfd socket{PQsocket(connection_), POLLIN, 0};
    const int ready = ::poll(&socket, 1, static_cast<int>(timeout_.count()));
    if (ready < 0 && errno == EINTR) {
      continue;
    }
    if (ready <= 0) {
      return lost(fmt::format("no answer for {} s", timeout_.count() / 1000));
    }
    if (PQconsumeInput(connection_) == 0) {
      return lost("the connection is lost");
    }
  }
  return PQgetResult(connection_);
}

// ---- one at a time ----

Status Session::receive(const std::function<void(Rows)>& take) {
  LM_RETURN_IF_ERROR(flush());
  Status status;
  for (;;) {
    LM_ASSIGN_OR_RETURN(PGresult * result, next_result());
    if (result == nullptr) {
      return status;
    }
    Rows rows(result);
    if (PQresultStatus(result) == PGRES_FATAL_ERROR && status.ok()) {
      status = failure_of(result);
      if (connection_ == nullptr) {
        return status;
      }
    }
    take(std::move(rows));
  }
}

Status Session::execute(const std::string& sql) {
  LM_RETURN_IF_ERROR(connect());
  return PQsendQuery(connection_, sql.c_str()) == 0 ? lost("cannot send") : receive([](const Rows&) {});
}

Status Session::send(const char* sql, const Parameters& parameters) {
  LM_RETURN_IF_ERROR(connect());
  return PQsendQueryParams(connection_, sql, parameters.count(), nullptr, parameters.values(), parameters.lengths(),
                           parameters.formats(), 1) == 0
             ? lost("cannot send")
             : ok_status();
}

Result<Rows> Session::query(const char* sql, const Parameters& parameters) {
  LM_RETURN_IF_ERROR(send(sql, parameters));
  Rows rows(nullptr);
  LM_RETURN_IF_ERROR(receive([&](Rows received) { rows = std::move(received); }));
  return rows;
}

Status Session::for_each(const std::string& select, const std::function<void(const stored::Row&)>& read) {
  LM_RETURN_IF_ERROR(send(select.c_str(), Parameters()));
  if (PQsetSingleRowMode(connection_) == 0) {
    return lost("cannot read single rows");
  }
  return receive([&](const Rows& rows) {
    for (int row = 0; row < rows.size(); ++row) {
      read(RowOf(rows, row));
    }
  });
}

// ---- batches ----

Status Session::begin_batch() {
  LM_RETURN_IF_ERROR(connect());
  batch_failure_ = ok_status();
  unanswered_.clear();
  if (PQenterPipelineMode(connection_) == 0) {
    return lost("cannot start a pipeline");
  }
  return ok_status();
}

void Session::add(int statement, const Parameters& parameters) {
  if (!batch_failure_.ok()) {
    return;
  }
  if (PQsendQueryPrepared(connection_, std::to_string(statement).c_str(), parameters.count(), parameters.values(),
                          parameters.lengths(), parameters.formats(), 1) == 0) {
    batch_failure_ = lost("cannot send");
    return;
  }
  unanswered_.push_back(statement);
  unsent_bytes_ += parameters.size_bytes();
  if (unsent_bytes_ > kMaxUnsentBytes) {
    batch_failure_ = flush();
  }
}

Status Session::read_batch(const std::function<void(int, const stored::Row&)>& read) {
  LM_RETURN_IF_ERROR(batch_failure_);
  if (PQpipelineSync(connection_) == 0) {
    return lost("cannot send");
  }
  LM_RETURN_IF_ERROR(flush());
  Status failure;
  for (bool synchronized = false; !synchronized;) {
    PQsetSingleRowMode(connection_);  // of the next statement, unless it has begun: a job may have millions of rows
    LM_ASSIGN_OR_RETURN(PGresult * result, next_result());
    if (result == nullptr) {  // between two statements
      if (PQstatus(connection_) != CONNECTION_OK) {
        return lost("the connection is lost");
      }
      if (!unanswered_.empty()) {
        unanswered_.pop_front();
      }
      continue;
    }
    const Rows rows(result);
    const ExecStatusType state = PQresultStatus(result);
    synchronized = state == PGRES_PIPELINE_SYNC;
    for (int row = 0; row < rows.size(); ++row) {
      read(unanswered_.front(), RowOf(rows, row));
    }
    if (state == PGRES_FATAL_ERROR && failure.ok()) {
      failure = failure_of(result);
      if (connection_ == nullptr) {
        return failure;
      }
    }
  }
  return failure.ok() ? failure : end_batch(failure);
}

Status Session::finish_batch() {
  LM_RETURN_IF_ERROR(read_batch([](int, const stored::Row&) {}));
  return end_batch(ok_status());
}

Status Session::end_batch(Status failure) {
  if (PQexitPipelineMode(connection_) == 0) {
    return lost("cannot end a pipeline");
  }
  if (!failure.ok() && PQtransactionStatus(connection_) != PQTRANS_IDLE) {
    const std::string state = last_state_;
    if (const Status status = execute("ROLLBACK"); !status.ok()) {
      close();
    }
    last_state_ = state;
  }
  return failure;
}

}  // namespace lightmill::postgres
