//! `report.html`: whole, the same when made twice, without network, safe whatever the files hold, and honest about what is
//! missing. `browser` looks at it in Chromium.

mod browser;
mod faults;
mod markup;
mod page;
mod program;
