#pragma once
// Whether what lies beside a database is ours: on a shared computer others may have put it there.

#include <string>

namespace palpate::data {

/// SQLite's files beside a database (log, index, journal), where there are any, are regular, belong
/// to us, to root or to the database's owner, and are open to nobody to whom the database is not:
/// through others' files participants' data would go out, and their contents come in. To be called
/// before SQLite opens them and again when it has. \param file links followed \throws StoreRefused.
void require_private_sqlite_files(const std::string& file);

/// Why others could get at a database or put files beside it, in a sentence; "" where they cannot.
std::string access_warning(const std::string& database);

}  // namespace palpate::data
