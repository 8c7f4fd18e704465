#pragma once

namespace tandem {

/// What this process frees from now on it keeps for what comes. A solve takes tens of megabytes, which the C library would
/// give back to the system and ask for again, page by page, in the next: a third of a study's time. On others than glibc
/// it does nothing.
void keep_freed_memory();

}  // namespace tandem
