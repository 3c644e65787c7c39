"""Who may look: those whom the address with its token was told, over HTTP and over the websocket."""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable
from typing import Any, Final

NAME: Final = "secret"  # of the token in addresses, as trame's page reads it for its websocket
HEADERS: Final = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
REFUSED: Final = "403: this page needs the whole address that seatfem view printed, with its token\n"


def new_token() -> str:
    """256 random bits, as an address can hold them."""
    return secrets.token_urlsafe(32)


def admit(app: Any, token: str) -> None:
    """Let an application of aiohttp answer nobody without the ``token``.

    The first address carries it; the answer sets it as a cookie, which the files of the page and the websocket bring
    along. The cookie is of this server alone, no script reads it, and no other site's page sends it. Where the page
    asks for its session, it is told the websocket of this server, with the token that the websocket asks for again.
    """
    from aiohttp import web

    cookie = f"seatfem-{secrets.token_hex(8)}"

    @web.middleware
    async def guarded(request: Any, handler: Callable[[Any], Awaitable[Any]]) -> Any:
        given = request.query.get(NAME, "") or request.cookies.get(cookie, "")
        if not secrets.compare_digest(given.encode("utf-8", "replace"), token.encode()):
            return web.Response(status=403, text=REFUSED, headers=HEADERS)
        response = await handler(request)
        if not response.prepared:
            response.headers.update(HEADERS)
            response.set_cookie(cookie, token, httponly=True, samesite="Strict", path="/")
        return response

    async def session(request: Any) -> Any:
        return web.json_response({"sessionURL": f"ws://{request.host}/ws", NAME: token})

    app.middlewares.append(guarded)
    app.router.add_post("/paraview/", session)
