//! Where the messages come from.

/// Answers the queries of the page. The server calls it from several threads.
///
/// A query is the end of an address: 1 to 300 of the characters `a-z`, `0-9`, `/`, `.`, `,`, `+`
/// and `-`, chosen by the page or by anyone who knows the token.
pub trait Source: Sync {
    /// The message that a query asks for.
    ///
    /// # Errors
    /// A sentence for the page: why there is no such message.
    fn answer(&self, query: &str) -> Result<Vec<u8>, String>;
}

impl<F: Fn(&str) -> Result<Vec<u8>, String> + Sync> Source for F {
    fn answer(&self, query: &str) -> Result<Vec<u8>, String> {
        self(query)
    }
}
