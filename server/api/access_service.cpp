#include "server/api/access_service.h"

#include "common/wire/bytes.h"
#include "common/wire/role_proto.h"
#include "server/api/grpc_status.h"
#include "server/api/pages.h"

namespace lightmill {
namespace {

void to_wire(const TokenRecord& token, v1::Token* out) {
  out->set_id(token.id);
  out->set_name(token.name);
  to_wire(token.roles, out->mutable_roles());
  out->set_made_by(token.made_by);
  out->set_made_unix_s(token.made_unix_s);
  out->set_until_unix_s(token.until_unix_s);
}

Result<TokenRecord> from_wire(const v1::CreateTokenRequest& request) {
  TokenRecord token;
  token.id = request.id();
  token.name = request.name();
  token.until_unix_s = request.until_unix_s();
  LM_ASSIGN_OR_RETURN(token.roles, roles_from_wire(request.roles()));
  const Result<Sha256> hash = digest_from_bytes(request.sha256());
  if (!hash.ok()) {
    return with_context(hash.status(), "sha256");
  }
  token.hash = *hash;
  return token;
}

grpc::ServerUnaryReactor* finished(grpc::CallbackServerContext* context, const Status& status) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(to_grpc(status));
  return reactor;
}

}  // namespace

AccessServiceImpl::Unary* AccessServiceImpl::CreateToken(Context* context, const v1::CreateTokenRequest* request,
                                                         v1::Token* reply) {
  const Result<Identity> caller = gate_.admit(*context, Rpc::create_token);
  Result<TokenRecord> token = caller.ok() ? from_wire(*request) : caller.status();
  if (!token.ok()) {
    return finished(context, token.status());
  }
  token->made_by = caller->name;
  Unary* reactor = context->DefaultReactor();
  const bool posted = loop_->post([this, token = std::move(*token), reply, reactor](FarmLoop::Turn& turn) mutable {
    token.made_unix_s = turn.unix_ms / 1000;
    const bool is_new = !gate_.find_token(token.id);
    if (const Status added = gate_.add_token(token); !added.ok()) {
      reactor->Finish(to_grpc(added));
      return;
    }
    to_wire(*gate_.find_token(token.id), reply);
    if (is_new) {
      turn.step.writes.push_back(PutToken{token});
    }
    turn.replies.push_back([this, id = token.id, is_new, reactor](const Status& stored) {
      if (!stored.ok() && is_new) {
        (void)gate_.remove_token(id);
      }
      reactor->Finish(to_grpc(stored));
    });
  });
  if (!posted) {
    reactor->Finish(busy());
  }
  return reactor;
}

AccessServiceImpl::Unary* AccessServiceImpl::ListTokens(Context* context, const v1::ListTokensRequest* request,
                                                        v1::ListTokensResponse* reply) {
  const Result<Identity> caller = gate_.admit(*context, Rpc::list_tokens);
  const Result<int> size = caller.ok() ? page_size_of(request->page_size()) : caller.status();
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
                                                         v1::RevokeTokenResponse*) {
  if (const Result<Identity> caller = gate_.admit(*context, Rpc::revoke_token); !caller.ok()) {
    return finished(context, caller.status());
  }
  Unary* reactor = context->DefaultReactor();
  const bool posted = loop_->post([this, id = request->id(), reactor](FarmLoop::Turn& turn) {
    if (const Status removed = gate_.remove_token(id); !removed.ok()) {
      reactor->Finish(to_grpc(removed));
      return;
    }
    turn.step.writes.push_back(DropToken{id});
    turn.replies.push_back([reactor](const Status& stored) { reactor->Finish(to_grpc(stored)); });
  });
  if (!posted) {
    reactor->Finish(busy());
  }
  return reactor;
}

}  // namespace lightmill
