#pragma once
// Whether other users of the computer can read or replace a database, or have put files beside it.

#include <string>

namespace palpate::data {

/// The -wal, -shm and -journal of a database, where they exist, must be regular files of this user,
/// root or the owner of the database, without hard links, and with no wider permissions than the
/// database: another user's file would receive participants' data, or inject content. To be called
/// before SQLite opens them and again afterwards. \param file links resolved \throws StoreRefused
void require_private_sqlite_files(const std::string& file);

/// A sentence on how other users could access the database or put files beside it; "": they cannot.
std::string access_warning(const std::string& database);

/// Why a file or folder that is about to be run or trusted is not safely this user's own, to be
/// appended to its path in a message; "": it is. Looks at the name itself (a link is none of ours),
/// its owner, its permissions, and at the folders above it.
std::string ownership_fault(const std::string& path);

}  // namespace palpate::data
