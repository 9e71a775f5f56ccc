// The owner of the shared precompiled header.
