// Operations on tokens and the action log.
#include <algorithm>
#include <cstdint>
#include <utility>

#include "common/base/number_text.h"
#include "common/wire/bytes.h"
#include "common/wire/role_proto.h"
#include "server/operations/handlers.h"
#include "server/operations/pages.h"

namespace lightmill::handlers {
namespace {

void to_wire(const TokenRecord& token, v1::Token* out) {
  out->set_id(token.id);
  out->set_name(token.name);
  to_wire(token.roles, out->mutable_roles());
  out->set_made_by(token.made_by);
  out->set_made_unix_s(token.made_unix_s);
  out->set_until_unix_s(token.until_unix_s);
  if (token.enrolment.workers > 0) {
    out->mutable_enrolment()->set_workers(token.enrolment.workers);
    out->mutable_enrolment()->set_enrolled(token.enrolment.enrolled);
    out->mutable_enrolment()->set_worker_seconds(token.enrolment.worker_seconds);
  }
  out->set_enrolled_by(token.enrolled_by);
}

Result<Sha256> hash_from_wire(const std::string& bytes) {
  const Result<Sha256> hash = digest_from_bytes(bytes);
  return hash.ok() ? hash : with_context(hash.status(), "sha256");
}

Result<TokenRecord> token_from_wire(const v1::CreateTokenRequest& request) {
  TokenRecord token;
  token.id = request.id();
  token.name = request.name();
  token.until_unix_s = request.until_unix_s();
  LM_ASSIGN_OR_RETURN(token.roles, roles_from_wire(request.roles()));
  LM_ASSIGN_OR_RETURN(token.hash, hash_from_wire(request.sha256()));
  token.enrolment = {request.enrolment().workers(), 0, request.enrolment().worker_seconds()};
  return token;
}

v1::Proof to_wire(Proof proof) {
  switch (proof) {
    case Proof::none:
      return v1::PROOF_NONE;
    case Proof::certificate:
      return v1::PROOF_CERTIFICATE;
    case Proof::token:
      return v1::PROOF_TOKEN;
  }
  return v1::PROOF_UNSPECIFIED;
}

void to_wire(const Action& action, v1::Action* out) {
  out->set_number(action.number);
  out->set_unix_ms(action.unix_ms);
  out->set_caller(action.caller);
  out->set_proof(to_wire(action.proof));
  out->set_token(action.token);
  out->set_peer(action.peer);
  out->set_operation(action.operation);
  out->set_job(action.job);
  out->set_about(action.about);
  out->set_code(static_cast<std::int32_t>(action.outcome));
  out->set_message(action.message);
  out->set_change(action.change);
}

/// Id of the enrolment token with which the bearer of this token can enrol again; empty: none.
std::string way_back(const AccessControl& access, const TokenRecord& token, std::int64_t now_unix_s) {
  const std::optional<TokenRecord> by = access.find_token(token.enrolled_by);
  return by && by->enrolment.enrolled < by->enrolment.workers && now_unix_s < by->until_unix_s ? by->id : "";
}

/// "30 days", "5 hours", rounded.
std::string span_text(std::int64_t seconds) {
  constexpr std::int64_t kHour = 3'600, kDay = 24 * kHour;
  const auto [unit, name] = seconds >= 2 * kDay    ? std::pair(kDay, "day")
                            : seconds >= 2 * kHour ? std::pair(kHour, "hour")
                                                   : std::pair(std::int64_t{60}, "minute");
  return counted(static_cast<std::size_t>((std::max<std::int64_t>(seconds, 0) + unit / 2) / unit), name);
}

/// "created: roles view, submit, valid for 30 days". A date would be in the coordinator's time zone.
std::string describe_new(const TokenRecord& token) {
  std::string text = fmt::format("created: roles {}, valid for {}", names_of(token.roles),
                                 span_text(token.until_unix_s - token.made_unix_s));
  if (token.enrolment.workers > 0) {
    text += ", for " + counted(token.enrolment.workers, "worker");
  }
  return text;
}

/// Stores the token with the effects of this task. If that fails, removes it.
void keep_token(OperationContext& operation, const TokenRecord& token) {
  operation.context.effects.writes.push_back(PutToken{token});
  operation.context.replies.push_back([&access = operation.runtime.access(), id = token.id](const Status& stored) {
    if (!stored.ok()) {
      (void)access.remove_token(id);
    }
  });
}

Status create_token(OperationContext& operation, const v1::CreateTokenRequest& request, v1::Token* reply) {
  AccessControl& access = operation.runtime.access();
  operation.about.text = request.id() + " for " + request.name();
  LM_ASSIGN_OR_RETURN(TokenRecord token, token_from_wire(request));
  token.made_by = operation.call.caller.name;
  token.made_unix_s = operation.context.unix_ms / 1000;
  const bool is_new = !access.find_token(token.id);
  LM_RETURN_IF_ERROR(access.add_token(token));
  to_wire(*access.find_token(token.id), reply);
  if (is_new) {
    operation.about.change = describe_new(token);
    keep_token(operation, token);
  }
  return ok_status();
}

Status list_tokens(OperationContext& operation, const v1::ListTokensRequest& request, v1::ListTokensResponse* reply) {
  LM_ASSIGN_OR_RETURN(const int size, page_size_of(request.page_size()));
  for (const TokenRecord& token : operation.runtime.access().tokens()) {
    if (token.id <= request.page_token()) {
      continue;  // on an earlier page; its last token may have been revoked since
    }
    if (reply->tokens_size() == size) {
      reply->set_next_page_token(reply->tokens(size - 1).id());
      break;
    }
    to_wire(token, reply->add_tokens());
  }
  operation.entries = static_cast<std::size_t>(reply->tokens_size());
  return ok_status();
}

Status revoke_token(OperationContext& operation, const v1::RevokeTokenRequest& request,
                    v1::RevokeTokenResponse* reply) {
  AccessControl& access = operation.runtime.access();
  const std::string& id = request.id();
  const std::optional<TokenRecord> token = access.find_token(id);
  if (token) {
    operation.about.text += " of " + token->name;
  }
  const std::vector<std::string> enrolled = access.enrolled_by(id);
  std::vector<std::string> revoked = request.enrolled() ? enrolled : std::vector<std::string>();
  operation.about.change = token ? "revoked: roles " + names_of(token->roles) : "revoked";
  if (!revoked.empty()) {
    operation.about.change += fmt::format(", with {} that it enrolled", counted(revoked.size(), "token"));
  }
  if (token || revoked.empty()) {
    revoked.push_back(id);
  }
  for (const std::string& each : revoked) {
    LM_RETURN_IF_ERROR(access.remove_token(each));
    operation.context.effects.writes.push_back(DropToken{each});
  }
  reply->set_enrolled(static_cast<std::uint32_t>(enrolled.size()));
  reply->set_enrols_again_by(token ? way_back(access, *token, operation.context.unix_ms / 1000) : "");
  return ok_status();
}

Status enrol(OperationContext& operation, const v1::EnrolRequest& request, v1::Token* reply) {
  operation.about.text = request.id() + " for " + request.host();
  LM_ASSIGN_OR_RETURN(const Sha256 hash, hash_from_wire(request.sha256()));
  LM_ASSIGN_OR_RETURN(const Enrolment enrolment,
                      operation.runtime.access().enrol(operation.call.caller, {request.id(), hash, request.host()}));
  operation.about.text = enrolment.token.id + " for " + enrolment.token.name;
  operation.about.was_there = !enrolment.is_new;
  to_wire(enrolment.token, reply);
  if (enrolment.is_new) {
    operation.about.change = fmt::format("{}, use {} of {}", describe_new(enrolment.token),
                                         enrolment.by.enrolment.enrolled, enrolment.by.enrolment.workers);
    for (const std::string& id : enrolment.ended) {
      operation.context.effects.writes.push_back(DropToken{id});
    }
    operation.context.effects.writes.push_back(
        PutToken{enrolment.by});  // this use of the enrolment token counts, even if storing fails
    keep_token(operation, enrolment.token);
  }
  return ok_status();
}

Status list_actions(OperationContext& operation, const v1::ListActionsRequest& request,
                    v1::ListActionsResponse* reply) {
  LM_ASSIGN_OR_RETURN(const int size, page_size_of(request.page_size()));
  LM_ASSIGN_OR_RETURN(const std::uint64_t before, id_in(request.page_token()));
  const ActionPage page = operation.context.actions.find(
      {request.job(), request.caller(), request.since_unix_ms(), before}, static_cast<std::size_t>(size));
  for (const Action& action : page.actions) {
    to_wire(action, reply->add_actions());
  }
  operation.entries = static_cast<std::size_t>(reply->actions_size());
  if (page.next > 0) {
    reply->set_next_page_token(std::to_string(page.next));
  }
  return ok_status();
}

}  // namespace

std::vector<Operation> access_operations() {
  return {
      {{kAccessService, "CreateToken", Right::administer, kRecorded}, "", on_farm(create_token)},
      {{kAccessService, "ListTokens", Right::administer}, "", on_farm(list_tokens)},
      {{kAccessService, "RevokeToken", Right::administer, kRecorded},
       "",
       named(&v1::RevokeTokenRequest::id, revoke_token)},
      {{kAccessService, "Enrol", Right::enrol, kRecorded}, "", on_farm(enrol)},
      {{kAccessService, "ListActions", Right::administer},
       "GET actions?page_size=1..1000&page_token&job&caller",
       on_farm(list_actions)},
  };
}

}  // namespace lightmill::handlers
