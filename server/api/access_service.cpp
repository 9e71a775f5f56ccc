#include "server/api/access_service.h"

#include "common/wire/bytes.h"
#include "common/wire/role_proto.h"
#include "server/api/grpc_status.h"
#include "server/api/recorded_calls.h"
#include "server/operations/pages.h"

namespace lightmill {
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
  out->set_who(action.who);
  out->set_proof(to_wire(action.proof));
  out->set_token(action.token);
  out->set_peer(action.peer);
  out->set_what(action.what);
  out->set_job(action.job);
  out->set_about(action.about);
  out->set_code(static_cast<std::int32_t>(action.outcome));
  out->set_message(action.message);
}

}  // namespace

AccessServiceImpl::Unary* AccessServiceImpl::CreateToken(Context* context, const v1::CreateTokenRequest* request,
                                                         v1::Token* reply) {
  return run_change(loop_, gate_, context, admit(gate_, *context, Rpc::create_token),
                    [this, request, reply](FarmLoop::Turn& turn, const Call& call, About& about) {
                      about.text = request->id() + " for " + request->name();
                      LM_ASSIGN_OR_RETURN(TokenRecord token, token_from_wire(*request));
                      token.made_by = call.caller.name;
                      token.made_unix_s = turn.unix_ms / 1000;
                      const bool is_new = !gate_.find_token(token.id);
                      LM_RETURN_IF_ERROR(gate_.add_token(token));
                      to_wire(*gate_.find_token(token.id), reply);
                      if (is_new) {
                        turn.effects.writes.push_back(PutToken{token});
                        turn.replies.push_back([this, id = token.id](const Status& stored) {
                          if (!stored.ok()) {
                            (void)gate_.remove_token(id);
                          }
                        });
                      }
                      return ok_status();
                    });
}

AccessServiceImpl::Unary* AccessServiceImpl::ListTokens(Context* context, const v1::ListTokensRequest* request,
                                                        v1::ListTokensResponse* reply) {
  const Result<Call> call = admit(gate_, *context, Rpc::list_tokens);
  const Result<int> size = call.ok() ? page_size_of(request->page_size()) : call.status();
  if (!size.ok()) {
    return finished(context, size.status());
  }
  for (const TokenRecord& token : gate_.tokens()) {
    if (token.id <= request->page_token()) {
      continue;  // on a page before; the token that ended it may have been revoked since
    }
    if (reply->tokens_size() == *size) {
      reply->set_next_page_token(reply->tokens(*size - 1).id());
      break;
    }
    to_wire(token, reply->add_tokens());
  }
  return finished(context, ok_status());
}

AccessServiceImpl::Unary* AccessServiceImpl::RevokeToken(Context* context, const v1::RevokeTokenRequest* request,
                                                         v1::RevokeTokenResponse* reply) {
  return run_change(loop_, gate_, context, admit(gate_, *context, Rpc::revoke_token, {0, request->id()}),
                    [this, request, reply](FarmLoop::Turn& turn, const Call&, About& about) {
                      const std::string& id = request->id();
                      about.text = id;
                      const std::optional<TokenRecord> token = gate_.find_token(id);
                      if (token) {
                        about.text += " of " + token->name;
                      }
                      const std::vector<std::string> enrolled = gate_.enrolled_by(id);
                      std::vector<std::string> revoked = request->enrolled() ? enrolled : std::vector<std::string>();
                      if (!revoked.empty()) {
                        about.text += fmt::format(" and {} that it enrolled", revoked.size());
                      }
                      if (token || revoked.empty()) {
                        revoked.push_back(id);
                      }
                      for (const std::string& each : revoked) {
                        LM_RETURN_IF_ERROR(gate_.remove_token(each));
                        turn.effects.writes.push_back(DropToken{each});
                      }
                      reply->set_enrolled(static_cast<std::uint32_t>(enrolled.size()));
                      reply->set_enrols_again_by(token ? way_back(*token, turn.unix_ms / 1000) : "");
                      return ok_status();
                    });
}

/// The enrolment token by which the bearer of this one can enrol again; empty: there is none.
std::string AccessServiceImpl::way_back(const TokenRecord& token, std::int64_t now_unix_s) const {
  const std::optional<TokenRecord> by = gate_.find_token(token.enrolled_by);
  return by && by->enrolment.enrolled < by->enrolment.workers && now_unix_s < by->until_unix_s ? by->id : "";
}

AccessServiceImpl::Unary* AccessServiceImpl::Enrol(Context* context, const v1::EnrolRequest* request,
                                                   v1::Token* reply) {
  return run_change(loop_, gate_, context, admit(gate_, *context, Rpc::enrol),
                    [this, request, reply](FarmLoop::Turn& turn, const Call& call, About& about) {
                      about.text = request->id() + " for " + request->host();
                      LM_ASSIGN_OR_RETURN(const Sha256 hash, hash_from_wire(request->sha256()));
                      LM_ASSIGN_OR_RETURN(const Enrolment enrolment,
                                          gate_.enrol(call.caller, {request->id(), hash, request->host()}));
                      about.text = enrolment.token.id + " for " + enrolment.token.name;
                      about.was_there = !enrolment.is_new;
                      to_wire(enrolment.token, reply);
                      if (enrolment.is_new) {
                        for (const std::string& id : enrolment.ended) {
                          turn.effects.writes.push_back(DropToken{id});
                        }
                        turn.effects.writes.push_back(PutToken{enrolment.by});
                        turn.effects.writes.push_back(PutToken{enrolment.token});
                        turn.replies.push_back([this, id = enrolment.token.id](const Status& stored) {
                          if (!stored.ok()) {  // the use stays taken
                            (void)gate_.remove_token(id);
                          }
                        });
                      }
                      return ok_status();
                    });
}

AccessServiceImpl::Unary* AccessServiceImpl::ListActions(Context* context, const v1::ListActionsRequest* request,
                                                         v1::ListActionsResponse* reply) {
  const Result<Call> call = admit(gate_, *context, Rpc::list_actions);
  const Result<int> size = call.ok() ? page_size_of(request->page_size()) : call.status();
  const Result<std::uint64_t> before = size.ok() ? id_in(request->page_token()) : size.status();
  if (!before.ok()) {
    return finished(context, before.status());
  }
  Unary* reactor = context->DefaultReactor();
  const ActionFilter filter{request->job(), request->who(), request->since_unix_ms(), *before};
  const bool posted = loop_.post([filter, most = *size, reply, reactor](FarmLoop::Turn& turn) {
    const ActionPage page = turn.actions.find(filter, static_cast<std::size_t>(most));
    for (const Action& action : page.actions) {
      to_wire(action, reply->add_actions());
    }
    if (page.next > 0) {
      reply->set_next_page_token(std::to_string(page.next));
    }
    reactor->Finish(grpc::Status::OK);
  });
  if (!posted) {
    reactor->Finish(busy());
  }
  return reactor;
}

}  // namespace lightmill
